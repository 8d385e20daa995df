#include "apps/experiments/experiment_config.hpp"

#include <algorithm>

#include "apps/experiments/yaml_keys.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;
using Texts = std::vector<std::string>;

constexpr const char* kTexts = "a list of texts";

YAML::Node load(const YamlSource& source) {
  if (!fs::is_regular_file(source.file))
    throw ExperimentConfigError(source.file.string() + ": no such file");
  try {
    return YAML::LoadFile(source.file.string());
  } catch (const YAML::Exception& error) {
    throw ExperimentConfigError(source.file.string() + " line " +
                                std::to_string(error.mark.line + 1) + ": " + error.msg);
  }
}

Texts texts(YamlKeys& keys, const std::string& key) {
  return keys.get<Texts>(key, kTexts).value_or(Texts{});
}

WorldConfig read_world(YamlSource& source, YamlKeys& keys, const std::string& name) {
  WorldConfig world;
  world.name = world.recordings = name;
  world.title = keys.get<std::string>("title", "a text").value_or(name);
  const auto file = [&](const char* key) -> fs::path {
    const auto text = keys.get<std::string>(key, "a path");
    if (!text || text->empty()) return {};
    const fs::path path = (source.file.parent_path() / *text).lexically_normal();
    if (!fs::is_regular_file(path))
      source.problem(keys.child(key), "no such file: " + path.string());
    return path;
  };
  world.simulation = file("simulation");
  world.original_config = file("original_config");
  world.simulate = texts(keys, "simulate");
  world.robots = keys.require<Texts>("robots", kTexts);
  if (const YAML::Node robots = keys.child("robots"); robots && world.robots.empty())
    source.problem(robots, "robots is empty");
  world.flights = keys.get<bool>("flights", "true or false").value_or(false);
  world.team = texts(keys, "team");
  world.robot = texts(keys, "robot");
  world.picture = texts(keys, "picture");
  for (const auto& [key, value] :
       {std::pair{"simulate_s", &world.simulate_s}, std::pair{"team_s", &world.team_s}}) {
    *value = keys.get<double>(key, "a number of seconds").value_or(*value);
    if (!(*value > 0.0)) source.problem(keys.child(key), std::string(key) + " is not positive");
  }
  return world;
}

// Trajectories do not depend on the map: runs that only tell their spread do without.
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

std::vector<WorldConfig> repetitions_of(const WorldConfig& world, YamlSource& source,
                                        YamlKeys& keys) {
  std::vector<WorldConfig> others;
  const auto runs = keys.get<unsigned>("runs", "a number").value_or(1);
  if (runs < 1 || runs > 99) source.problem(keys.child("runs"), "runs is not from 1 to 99");
  for (unsigned run = 2; run <= std::min(runs, 99U); ++run)
    others.push_back(repetition(world, "run", run));
  for (const unsigned seed : keys.get<std::vector<unsigned>>("seeds", "a list of numbers")
                                 .value_or(std::vector<unsigned>{})) {
    others.push_back(repetition(world, "seed", seed));
    others.back().recordings = others.back().name;
    set_seed(others.back().simulate, seed);
  }
  return others;
}

std::vector<WorldConfig> read_worlds(YamlSource source, bool quick) {
  std::vector<WorldConfig> worlds;
  const YAML::Node root = load(source);
  if (!root.IsMap()) {
    source.problem(root, "expected a world and its keys here");
    return worlds;
  }
  for (const auto& entry : root) {
    YamlKeys keys(source, entry.second, quick);
    worlds.push_back(read_world(source, keys, entry.first.Scalar()));
    const auto others = repetitions_of(worlds.back(), source, keys);
    worlds.insert(worlds.end(), others.begin(), others.end());
    keys.finish();
  }
  return worlds;
}

PcmExperiment read_pcm(YamlSource source, bool quick) {
  const YAML::Node root = load(source);
  YamlKeys keys(source, root, quick);
  PcmExperiment pcm;
  pcm.graph = keys.require<std::string>("graph", "a path");
  pcm.closures = keys.get<std::size_t>("closures", "a number").value_or(0);
  pcm.outliers = keys.get<std::size_t>("outliers", "a number").value_or(0);
  pcm.seeds = keys.require<std::vector<unsigned>>("seeds", "a list of numbers");
  pcm.searches = keys.require<Texts>("searches", kTexts);
  pcm.seed_s = keys.get<double>("seed_s", "a number of seconds").value_or(pcm.seed_s);
  for (const std::string& search : pcm.searches)
    if (search != "exact" && search != "incremental" && search != "batch")
      source.problem(keys.child("searches"), search + " is not exact, incremental or batch");
  for (const auto& [key, empty] :
       {std::pair{"searches", pcm.searches.empty()}, std::pair{"seeds", pcm.seeds.empty()}})
    if (const YAML::Node node = keys.child(key); node && node.IsSequence() && empty)
      source.problem(node, std::string(key) + " is empty");
  keys.finish();
  return pcm;
}

PgoMethodConfig read_method(YamlSource& source, const YAML::Node& node, bool quick) {
  YamlKeys keys(source, node, quick);
  PgoMethodConfig method;
  method.name = keys.require<std::string>("name", "a text");
  method.title = keys.get<std::string>("title", "a text").value_or(method.name);
  method.arguments = keys.require<Texts>("arguments", kTexts);
  keys.finish();
  return method;
}

Texts read_names(YamlSource& source, YamlKeys& keys, const std::vector<WorldConfig>& worlds) {
  Texts names = keys.require<Texts>("worlds", kTexts);
  for (const std::string& name : names)
    if (std::none_of(worlds.begin(), worlds.end(), [&](const auto& w) { return w.name == name; }))
      source.problem(keys.child("worlds"), "no world " + name + " in worlds.yaml");
  return names;
}

Texts read_world_names(YamlSource source, const std::vector<WorldConfig>& worlds, bool quick) {
  const YAML::Node root = load(source);
  YamlKeys keys(source, root, quick);
  Texts names = read_names(source, keys, worlds);
  keys.finish();
  return names;
}

AloneExperiment read_alone(YamlSource& source, const YAML::Node& node, bool quick,
                           const std::vector<WorldConfig>& worlds) {
  AloneExperiment alone;
  if (!node) return alone;
  YamlKeys keys(source, node, quick);
  alone.world = keys.require<std::string>("world", "a text");
  alone.robot = keys.require<std::string>("robot", "a text");
  alone.arguments = texts(keys, "arguments");
  const auto world = std::find_if(worlds.begin(), worlds.end(),
                                  [&](const auto& w) { return w.name == alone.world; });
  if (world == worlds.end())
    source.problem(keys.child("world"), "no world " + alone.world + " in worlds.yaml");
  else if (std::count(world->robots.begin(), world->robots.end(), alone.robot) == 0)
    source.problem(keys.child("robot"), alone.world + " has no robot " + alone.robot);
  keys.finish();
  return alone;
}

void read_resources(YamlSource source, bool quick, ExperimentConfig& config) {
  const YAML::Node root = load(source);
  YamlKeys keys(source, root, quick);
  config.resources_worlds = read_names(source, keys, config.worlds);
  config.alone = read_alone(source, keys.child("alone"), quick, config.worlds);
  keys.finish();
}

void read_trajectory(YamlSource source, bool quick, ExperimentConfig& config) {
  const YAML::Node root = load(source);
  YamlKeys keys(source, root, quick);
  config.trajectory_worlds = read_names(source, keys, config.worlds);
  const YAML::Node methods = keys.child("methods");
  if (!methods || !methods.IsSequence() || methods.size() == 0)
    source.problem(root, "methods is not a list of at least one method");
  else
    for (const YAML::Node& node : methods)
      config.methods.push_back(read_method(source, node, quick));
  keys.finish();
}

}  // namespace

const WorldConfig& ExperimentConfig::world(const std::string& name) const {
  return *std::find_if(worlds.begin(), worlds.end(),
                       [&](const WorldConfig& world) { return world.name == name; });
}

std::vector<std::string> ExperimentConfig::repetitions(const std::string& world) const {
  std::vector<std::string> names;
  for (const WorldConfig& other : worlds)
    if (other.repeats == world) names.push_back(other.name);
  return names;
}

ExperimentConfig read_experiments(const fs::path& folder, bool quick) {
  std::string problems;
  const auto source = [&](const char* name) { return YamlSource{folder / name, problems}; };
  ExperimentConfig config;
  config.quick = quick;
  config.worlds = read_worlds(source("worlds.yaml"), quick);
  config.pcm = read_pcm(source("pcm.yaml"), quick);
  read_trajectory(source("trajectory.yaml"), quick, config);
  read_resources(source("resources.yaml"), quick, config);
  config.mesh_worlds = read_world_names(source("mesh.yaml"), config.worlds, quick);
  config.semantics_worlds = read_world_names(source("semantics.yaml"), config.worlds, quick);
  if (!problems.empty()) throw ExperimentConfigError(problems);
  return config;
}

}  // namespace km
