#include "apps/experiments/experiment_plan.hpp"

#include <algorithm>

#include "apps/experiments/recorded_flight_files.hpp"
#include "apps/experiments/world_steps.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

std::vector<Step> pcm_steps(const PcmExperiment& pcm, const ExperimentPaths& paths) {
  const fs::path graph = paths.graphs / pcm.graph;
  std::vector<Step> steps;
  for (const unsigned seed : pcm.seeds) {
    const PcmFiles files = pcm_files(seed, paths);
    Step step{.name = "pcm-" + std::to_string(seed),
              .title = "consistent closures, seed " + std::to_string(seed),
              .command = {(paths.programs / "kimera_multi_pgo").string(), "pcm", graph.string(),
                          "--outliers", std::to_string(pcm.outliers), "--closures",
                          std::to_string(pcm.closures), "--seed", std::to_string(seed), "--search"},
              .inputs = {graph},
              .outputs = {files.json, files.plot},
              .expected_s = pcm.seed_s};
    append(step.command, pcm.searches);
    append(step.command, {"--json", files.json.string(), "--plot", files.plot.string()});
    if (!fs::exists(graph))
      step.missing = "no pose graph " + graph.string() + "; --graphs says where it is";
    steps.push_back(std::move(step));
  }
  return steps;
}

std::vector<Step> pgo_steps(const WorldConfig& world, const std::vector<PgoMethodConfig>& methods,
                            const ExperimentPaths& paths) {
  std::vector<Step> steps;
  for (const PgoMethodConfig& method : methods) {
    const PgoFiles files = pgo_files(world, method, paths);
    const fs::path folder = graph_folder(world, paths);
    Step step{.name = files.json.stem().string(),
              .title = method.title + ", " + world.title,
              .command = {(paths.programs / "kimera_multi_pgo").string(), "solve", folder.string()},
              .outputs = {files.json, files.poses},
              .needs = {team_step_name(world)},
              .expected_s = 2.0};
    append(step.command, method.arguments);
    append(step.command, {"--json", files.json.string(), "--output", files.poses.string()});
    for (const std::string& robot : world.robots) {
      const fs::path graph = world_files(world, paths).run / robot / "pose_graph.g2o";
      step.inputs.push_back(graph);
      step.copies.emplace_back(graph, folder / (robot + ".g2o"));
    }
    steps.push_back(std::move(step));
  }
  return steps;
}

// The recording of its world, and the robot on it.
std::vector<Step> alone_steps(const ExperimentConfig& config, const ExperimentPaths& paths) {
  const WorldConfig& world = config.world(config.alone.world);
  const AloneFiles files = alone_files(config, paths);
  Step step{
      .name = "alone-" + world.name,
      .title = "one robot alone, without a map, " + world.title + ", " + config.alone.robot,
      .command = {(paths.programs / "kimera_multi_robot").string(), "--robot", "0", "--name",
                  config.alone.robot, "--dataset", files.recording.string(), "--output",
                  files.run.string()},
      .outputs = {files.run / "summary.json", files.run / "timing.csv", files.run / "odometry.tum"},
      .expected_s = 0.25 * world.team_s};
  append(step.command, config.alone.arguments);
  std::vector<Step> steps = world_steps(world, paths);
  steps.pop_back();  // the team
  if (world_files(world, paths).original) {
    if (!world.original_config.empty())
      append(step.command, {"--config", world.original_config.string()});
    step.inputs = {files.recording / "mav0/cam0/data.csv"};
  } else {
    step.inputs = {world_files(world, paths).recordings / "simulation.json"};
    step.needs = {simulate_step_name(world)};
  }
  steps.push_back(std::move(step));
  return steps;
}

void append_steps(std::vector<Step>& steps, std::vector<Step> more) {
  for (Step& step : more) {
    const auto same = [&](const Step& other) { return other.name == step.name; };
    if (std::none_of(steps.begin(), steps.end(), same)) steps.push_back(std::move(step));
  }
}

}  // namespace

WorldFiles world_files(const WorldConfig& world, const ExperimentPaths& paths) {
  WorldFiles files;
  files.original = has_original_images(world, paths);
  files.recordings = paths.data / world.recordings;
  files.team_file = files.original ? paths.results / "teams" / (world.name + ".yaml")
                                   : files.recordings / "team.yaml";
  files.run = paths.data / (world.name + (files.original ? "_euroc_res" : "_res"));
  files.team_json = paths.results / ("team-" + world.name + ".json");
  return files;
}

fs::path graph_folder(const WorldConfig& world, const ExperimentPaths& paths) {
  return paths.results / "graphs" / world.name;
}

PgoFiles pgo_files(const WorldConfig& world, const PgoMethodConfig& method,
                   const ExperimentPaths& paths) {
  const std::string name = "pgo-" + world.name + '-' + method.name;
  return {paths.results / (name + ".json"), paths.results / "poses" / (name + ".tum")};
}

AloneFiles alone_files(const ExperimentConfig& config, const ExperimentPaths& paths) {
  const WorldConfig& world = config.world(config.alone.world);
  const WorldFiles files = world_files(world, paths);
  return {files.original ? find_recorded_flight(paths.euroc, config.alone.robot).folder
                         : files.recordings / config.alone.robot,
          paths.data / (world.name + (files.original ? "_euroc_alone" : "_alone"))};
}

PcmFiles pcm_files(unsigned seed, const ExperimentPaths& paths) {
  const std::string name = "pcm-" + std::to_string(seed);
  return {paths.results / (name + ".json"), paths.results / "figures" / (name + ".svg")};
}

fs::path picture_file(const WorldConfig& world, bool corrected, const ExperimentPaths& paths) {
  return paths.results / "figures" /
         ("mesh-" + world.name + (corrected ? "-after.png" : "-before.png"));
}

std::vector<Step> plan_experiment(const std::string& experiment, const ExperimentConfig& config,
                                  const ExperimentPaths& paths) {
  if (experiment == "pcm") return pcm_steps(config.pcm, paths);
  const std::vector<std::string>& worlds = experiment == "trajectory"  ? config.trajectory_worlds
                                           : experiment == "resources" ? config.resources_worlds
                                           : experiment == "mesh"      ? config.mesh_worlds
                                                                       : config.semantics_worlds;
  std::vector<Step> steps;
  for (const std::string& name : worlds) {
    const WorldConfig& world = config.world(name);
    append_steps(steps, world_steps(world, paths));
    if (experiment == "mesh") append_steps(steps, picture_steps(world, paths));
    if (experiment != "trajectory" && experiment != "resources") continue;
    append_steps(steps, pgo_steps(world, config.methods, paths));
    for (const std::string& repetition : config.repetitions(name)) {
      append_steps(steps, world_steps(config.world(repetition), paths));
      append_steps(steps, pgo_steps(config.world(repetition), config.methods, paths));
    }
  }
  if (experiment == "resources" && !config.alone.world.empty())
    append_steps(steps, alone_steps(config, paths));
  return steps;
}

std::vector<Step> plan_experiments(const std::vector<std::string>& experiments,
                                   const ExperimentConfig& config, const ExperimentPaths& paths) {
  std::vector<Step> steps;
  for (const std::string& experiment : experiments)
    append_steps(steps, plan_experiment(experiment, config, paths));
  return steps;
}

}  // namespace km
