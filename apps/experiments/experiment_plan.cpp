#include "apps/experiments/experiment_plan.hpp"

#include <algorithm>

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
              .command = {(paths.programs / "kimera_multi_pcm").string(), graph.string(),
                          "--outliers", std::to_string(pcm.outliers), "--closures",
                          std::to_string(pcm.closures), "--seed", std::to_string(seed), "--search"},
              .inputs = {graph},
              .outputs = {files.json, files.plot},
              .expected_s = 20.0};
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
              .command = {(paths.programs / "kimera_multi_pgo").string(), folder.string()},
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
  files.recordings = paths.data / world.name;
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
    if (experiment == "trajectory" || experiment == "resources")
      append_steps(steps, pgo_steps(world, config.methods, paths));
    if (experiment == "mesh") append_steps(steps, picture_steps(world, paths));
  }
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
