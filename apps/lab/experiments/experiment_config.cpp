#include "apps/lab/experiments/experiment_config.hpp"

#include <algorithm>

#include "runtime/config_text.hpp"
#include "runtime/yaml_config.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;
using Texts = std::vector<std::string>;

constexpr const char* kPaperRun = "-paper";

const WorldConfig* find_world(const std::vector<WorldConfig>& worlds, const std::string& name) {
  const auto found = std::find_if(worlds.begin(), worlds.end(),
                                  [&](const WorldConfig& world) { return world.name == name; });
  return found == worlds.end() ? nullptr : &*found;
}

// Trajectories do not depend on the map, so runs that only show the spread have none.
WorldConfig repetition(const WorldConfig& world, const std::string& kind, unsigned number) {
  WorldConfig other = world;
  other.name += '-' + kind + std::to_string(number);
  other.title += ", " + kind + ' ' + std::to_string(number);
  other.repeats = world.name;
  other.robot.insert(other.robot.end(), {"--set", "mapping.mode=off"});
  return other;
}

void set_seed(Texts& arguments, unsigned seed) {
  const auto given = std::find(arguments.begin(), arguments.end(), "--seed");
  if (given != arguments.end() && given + 1 != arguments.end())
    *(given + 1) = std::to_string(seed);
  else
    arguments.insert(arguments.end(), {"--seed", std::to_string(seed)});
}

// Sets the names of a world and its repetitions, and the options in which they differ.
void add_with_repetitions(WorldConfig world, const std::string& name,
                          std::vector<WorldConfig>& worlds) {
  world.name = world.recordings = name;
  if (world.title.empty()) world.title = name;
  worlds.push_back(world);
  for (unsigned run = 2; run <= world.runs; ++run) worlds.push_back(repetition(world, "run", run));
  for (const unsigned seed : world.seeds) {
    WorldConfig& other = worlds.emplace_back(repetition(world, "seed", seed));
    other.recordings = other.name;
    set_seed(other.simulate, seed);
  }
}

// The paper's pipeline on the recordings of a world. It is another method and therefore no
// repetition.
WorldConfig run_by_pipeline(const WorldConfig& world, const Texts& robot_options) {
  WorldConfig other = world;
  other.name += kPaperRun;
  other.title += ", PCM then RBCD";
  other.robot.insert(other.robot.end(), {"--set", "mapping.mode=off"});
  other.robot.insert(other.robot.end(), robot_options.begin(), robot_options.end());
  return other;
}

// Adds the world of every run to `config.worlds`.
void add_level_runs(const LevelExperiment& levels, ExperimentConfig& config) {
  for (const LevelSeeds& level : levels.levels)
    for (const LevelWorld& world : levels.worlds) {
      if (!world.levels.empty() &&
          std::ranges::find(world.levels, level.level) == world.levels.end())
        continue;
      for (const unsigned seed : level.seeds) {
        const std::string number = std::to_string(level.level);
        WorldConfig run{
            .name = "level" + number + '-' + world.name + "-seed" + std::to_string(seed),
            .title = (world.title.empty() ? world.name : world.title) + ", level " + number +
                     ", seed " + std::to_string(seed),
            .robots = {},
            .simulation = {},
            .simulate = world.simulate,
            .original_config = {},
            .team = levels.team,
            .robot = levels.robot,
            .seeds = {},
            .picture = {},
            .simulate_s = levels.simulate_s,
            .team_s = levels.team_s};
        run.recordings = run.name;
        for (unsigned robot = 0; robot < levels.robots; ++robot)
          run.robots.push_back("robot" + std::to_string(robot));
        run.simulate.insert(run.simulate.end(), levels.simulate.begin(), levels.simulate.end());
        run.simulate.insert(run.simulate.end(),
                            {"--robots", std::to_string(levels.robots), "--difficulty", number});
        set_seed(run.simulate, seed);
        config.level_runs.push_back({level.level, run.name, world.length});
        config.worlds.push_back(std::move(run));
      }
    }
}

void read_names(YamlFields& fields, const std::vector<WorldConfig>& worlds, Texts& names) {
  fields.field("worlds", names);
  fields.required({"worlds"});
  for (const std::string& name : names)
    fields.check(find_world(worlds, name) != nullptr, "worlds",
                 "has " + name + ", which is not in worlds.yaml");
}

}  // namespace

const WorldConfig& ExperimentConfig::world(const std::string& name) const {
  return *find_world(worlds, name);
}

const WorldConfig* ExperimentConfig::paper_run(const std::string& world) const {
  return find_world(worlds, world + kPaperRun);
}

std::vector<std::string> ExperimentConfig::repetitions(const std::string& world) const {
  std::vector<std::string> names;
  for (const WorldConfig& other : worlds)
    if (other.repeats == world) names.push_back(other.name);
  return names;
}

ExperimentConfig read_experiments(const fs::path& folder, bool quick) {
  ConfigProblems problems;
  const ConfigContext context{.problems = problems, .folder = folder, .quick = quick};
  const auto read = [&](const char* name, const auto& visit) {
    const std::string file = (folder / name).string();
    const ConfigSection section = read_section(load_yaml(file), "", file, context);
    YamlFields fields(section, "", context);
    visit(fields);
    fields.finish();
  };
  ExperimentConfig config;
  config.quick = quick;
  const std::string worlds = (folder / "worlds.yaml").string();
  for (const auto& [name, value] : read_section(load_yaml(worlds), "", worlds, context).values) {
    WorldConfig world;
    fill_config(read_section(value.node, name, worlds, context), name, context, world);
    add_with_repetitions(world, name, config.worlds);
  }
  read("pcm.yaml", [&](YamlFields& fields) { config.pcm.visit_fields(fields); });
  read("cosmo.yaml", [&](YamlFields& fields) {
    fields.sections("sets", config.cosmo.sets);
    fields.required({"sets"});
  });
  read("trajectory.yaml", [&](YamlFields& fields) {
    read_names(fields, config.worlds, config.trajectory_worlds);
    fields.sections("methods", config.methods);
    fields.field("paper_pipeline", config.paper_pipeline);
    fields.required({"methods"});
  });
  read("resources.yaml", [&](YamlFields& fields) {
    read_names(fields, config.worlds, config.resources_worlds);
    fields.section("alone", config.alone);
    if (config.alone.world.empty()) return;
    const WorldConfig* world = find_world(config.worlds, config.alone.world);
    fields.check(world != nullptr, "alone", "has a world that is not in worlds.yaml");
    fields.check(world == nullptr ||
                     std::count(world->robots.begin(), world->robots.end(), config.alone.robot) > 0,
                 "alone", "has a robot that its world has not");
  });
  read("mesh.yaml",
       [&](YamlFields& fields) { read_names(fields, config.worlds, config.mesh_worlds); });
  read("semantics.yaml",
       [&](YamlFields& fields) { read_names(fields, config.worlds, config.semantics_worlds); });
  LevelExperiment levels;
  read("levels.yaml", [&](YamlFields& fields) {
    fields.sections("worlds", levels.worlds);
    fields.sections("levels", levels.levels);
    levels.visit_fields(fields);
    fields.required({"worlds", "levels"});
  });
  problems.finish();
  if (!config.paper_pipeline.empty())
    for (const std::string& name : config.trajectory_worlds)
      config.worlds.push_back(run_by_pipeline(config.world(name), config.paper_pipeline));
  add_level_runs(levels, config);
  for (PgoMethodConfig& method : config.methods)
    if (method.title.empty()) method.title = method.name;
  for (CosmoSet& set : config.cosmo.sets)
    if (set.title.empty()) set.title = set.stem();
  return config;
}

std::string world_keys() {
  return keys_of(WorldConfig());
}

}  // namespace km
