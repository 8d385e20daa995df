#include "apps/lab/experiments/experiment_plan.hpp"

#include <yaml-cpp/yaml.h>
#include <algorithm>
#include <fstream>

#include "apps/lab/experiments/step_record.hpp"
#include "modules/core/text_rows.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr int kDepth = 3;

std::vector<fs::path> entries_named(const fs::path& place, const std::string& name) {
  std::vector<fs::path> found;
  std::error_code error;
  fs::recursive_directory_iterator walk(place, fs::directory_options::skip_permission_denied,
                                        error);
  for (; !error && walk != fs::recursive_directory_iterator(); walk.increment(error)) {
    const std::string entry = walk->path().filename().string();
    if (entry.starts_with(name)) found.push_back(walk->path());
    // Recordings are not searched, because they contain only thousands of images.
    if (walk.depth() + 1 >= kDepth || entry == "mav0" || entry.starts_with(name))
      walk.disable_recursion_pending();
  }
  std::sort(found.begin(), found.end());
  return found;
}

// Time between the first and the last image of the left camera with a file [s].
double recorded_s(const fs::path& folder) {
  const fs::path camera = folder / "mav0/cam0";
  std::error_code error;
  std::int64_t first = 0, last = 0;
  for (const auto& image : fs::directory_iterator(camera / "data", error)) {
    const auto stamp = parse_int64(image.path().stem().string());
    if (!stamp) continue;
    first = first == 0 ? *stamp : std::min(first, *stamp);
    last = std::max(last, *stamp);
  }
  return 1e-9 * static_cast<double>(last - first);
}

bool is_table(const std::string& name) {
  const auto ends = [&](const char* end) { return name.ends_with(end); };
  return ends(".csv") || ends(".csv.gz") || ends(".txt") || ends(".txt.gz");
}

void take(const fs::path& file, fs::path& place) {
  if (place.empty() && fs::is_regular_file(file)) place = file;
}

// True if EuRoC's own images of all robots exist.
bool has_original_images(const WorldConfig& world, const ExperimentPaths& paths) {
  return world.flights && !paths.euroc.empty() &&
         std::all_of(world.robots.begin(), world.robots.end(), [&](const std::string& robot) {
           return !find_recorded_flight(paths.euroc, robot).folder.empty();
         });
}

void append(std::vector<std::string>& list, const std::vector<std::string>& more) {
  list.insert(list.end(), more.begin(), more.end());
}

std::string simulate_step_name(const WorldConfig& world) {
  return "simulate-" + world.recordings;
}

std::string team_step_name(const WorldConfig& world) {
  return "team-" + world.name;
}

// The simulator writes whether it was completed.
bool is_complete(const fs::path& simulation_json) try {
  return fs::is_regular_file(simulation_json) &&
         YAML::LoadFile(simulation_json.string())["complete"].as<bool>(false);
} catch (const YAML::Exception&) {
  return false;
}

// Options that make the robots move as recorded; missing files are noted in the step.
void add_flights(const WorldConfig& world, const ExperimentPaths& paths, Step& step) {
  std::vector<std::string> truths, imus;
  for (const std::string& robot : world.robots) {
    const RecordedFlightFiles flight = find_recorded_flight(paths.euroc, robot);
    if (flight.truth.empty() || flight.imu.empty()) {
      step.missing = "no true poses and inertial data of " + robot +
                     (paths.euroc.empty() ? std::string() : " in " + paths.euroc.string()) +
                     "; --euroc names the folder of the EuRoC recordings";
      return;
    }
    truths.push_back(flight.truth.string());
    imus.push_back(flight.imu.string());
    step.inputs.insert(step.inputs.end(), {flight.truth, flight.imu});
  }
  const auto add = [&](const char* option, const std::vector<std::string>& values) {
    step.command.emplace_back(option);
    append(step.command, values);
  };
  add("--trajectory", truths);
  add("--imu", imus);
  add("--names", world.robots);
}

Step simulate_step(const WorldConfig& world, const ExperimentPaths& paths) {
  const WorldFiles files = world_files(world, paths);
  const fs::path made = files.recordings / "simulation.json";
  Step step{.name = simulate_step_name(world),
            .title = "recordings, " + world.title,
            .command = {(paths.programs / "kimera_multi_simulate").string()},
            .outputs = {made, files.team_file},
            .adoptable = is_complete(made),
            .expected_s = world.simulate_s};
  if (!world.simulation.empty()) {
    append(step.command, {"--config", world.simulation.string()});
    step.inputs.push_back(world.simulation);
  }
  append(step.command, world.simulate);
  if (world.flights) add_flights(world, paths, step);
  append(step.command, {"--output", files.recordings.string()});
  return step;
}

// A team on EuRoC's own folders. They have no labels, and no true mesh to compare with.
std::string original_team_file(const WorldConfig& world, const ExperimentPaths& paths) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  if (!world.original_config.empty())
    out << YAML::Key << "config" << YAML::Value << fs::absolute(world.original_config).string();
  out << YAML::Key << "arguments" << YAML::Value << YAML::Flow
      << std::vector<std::string>{"--set", "mapping.mode=metric"} << YAML::Key << "robots"
      << YAML::Value << YAML::BeginSeq;
  for (std::size_t i = 0; i < world.robots.size(); ++i) {
    const RecordedFlightFiles flight = find_recorded_flight(paths.euroc, world.robots[i]);
    out << YAML::BeginMap << YAML::Key << "id" << YAML::Value << i << YAML::Key << "name"
        << YAML::Value << world.robots[i] << YAML::Key << "dataset" << YAML::Value
        << fs::absolute(flight.folder).string() << YAML::Key << "truth" << YAML::Value
        << fs::absolute(flight.truth).string() << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::EndMap;
  return std::string(out.c_str()) + '\n';
}

std::vector<fs::path> of_robots(const WorldConfig& world, const fs::path& run, const char* file) {
  std::vector<fs::path> paths;
  for (const std::string& robot : world.robots) paths.push_back(run / robot / file);
  return paths;
}

// True poses of each robot; empty if those of some robot are unknown.
std::vector<fs::path> true_poses(const WorldConfig& world, const WorldFiles& files,
                                 const ExperimentPaths& paths) {
  if (!files.original)
    return of_robots(world, files.recordings, "mav0/state_groundtruth_estimate0/data.csv");
  std::vector<fs::path> truths;
  for (const std::string& robot : world.robots) {
    truths.push_back(find_recorded_flight(paths.euroc, robot).truth);
    if (truths.back().empty()) return {};
  }
  return truths;
}

// A run that was made elsewhere is not repeated, but its tables are made again.
bool made_elsewhere(const Step& step, const std::vector<fs::path>& summaries,
                    const ExperimentPaths& paths) {
  if (!all_exist(summaries)) return false;
  const auto record = read_record(paths.results, step.name);
  return !record || std::count(record->command.begin(), record->command.end(), "--report") > 0;
}

Step team_step(const WorldConfig& world, const ExperimentPaths& paths) {
  const WorldFiles files = world_files(world, paths);
  const std::vector<fs::path> summaries = of_robots(world, files.run, "summary.json");
  Step step{.name = team_step_name(world),
            .title = "team, " + world.title,
            .command = {(paths.programs / "kimera_multi_team").string(), "--config",
                        files.team_file.string(), "--output", files.run.string(), "--json",
                        files.team_json.string()},
            .outputs = {files.team_json},
            .expected_s = world.team_s};
  step.outputs.insert(step.outputs.end(), summaries.begin(), summaries.end());
  if (files.original)
    step.writes = {{files.team_file, original_team_file(world, paths)}};
  else
    step.needs = {simulate_step_name(world)};
  if (made_elsewhere(step, summaries, paths)) {
    step.title = "tables of the team's run, " + world.title;
    step.command.emplace_back("--report");
    step.expected_s = 60.0;
    for (const char* file :
         {"summary.json", "pose_graph.g2o", "optimized.tum", "mesh.ply", "mesh_optimized.ply"})
      for (const fs::path& path : of_robots(world, files.run, file)) step.inputs.push_back(path);
    return step;
  }
  if (!files.original) step.inputs = {files.recordings / "simulation.json", files.team_file};
  append(step.command, world.team);
  if (!world.robot.empty()) step.command.emplace_back("--");
  append(step.command, world.robot);
  return step;
}

// Recordings of a world, unless another world or EuRoC provides them, and the team's run on them.
std::vector<Step> world_steps(const WorldConfig& world, const ExperimentPaths& paths) {
  std::vector<Step> steps;
  const bool has_own =
      world.recordings == world.name;  // otherwise the world that it repeats makes the recordings
  if (has_own && !has_original_images(world, paths)) steps.push_back(simulate_step(world, paths));
  steps.push_back(team_step(world, paths));
  return steps;
}

// Pictures of the team's meshes before and after the correction.
std::vector<Step> picture_steps(const WorldConfig& world, const ExperimentPaths& paths) {
  const WorldFiles files = world_files(world, paths);
  const std::vector<fs::path> truths = true_poses(world, files, paths);
  std::vector<Step> steps;
  for (const bool corrected : {false, true}) {
    const fs::path picture = picture_file(world, corrected, paths);
    Step step{.name = picture.stem().string(),
              .title = std::string("picture ") + (corrected ? "after" : "before") +
                       " correction, " + world.title,
              .command = {(paths.programs / "kimera_multi_evaluate").string(), "render", "--mesh"},
              .outputs = {picture},
              .needs = {team_step_name(world)},
              .expected_s = 10.0};
    const auto meshes = of_robots(world, files.run, corrected ? "mesh_optimized.ply" : "mesh.ply");
    const auto trajectories = of_robots(world, files.run, "optimized.tum");
    for (const fs::path& mesh : meshes) step.command.push_back(mesh.string());
    step.command.emplace_back("--trajectory");
    for (const fs::path& trajectory : trajectories) step.command.push_back(trajectory.string());
    step.inputs = meshes;
    step.inputs.insert(step.inputs.end(), trajectories.begin(), trajectories.end());
    if (!truths.empty()) {  // they turn the map upright
      step.command.emplace_back("--reference");
      for (const fs::path& truth : truths) step.command.push_back(truth.string());
    }
    append(step.command, world.picture);
    append(step.command, {"--output", picture.string()});
    steps.push_back(std::move(step));
  }
  return steps;
}

std::vector<Step> cosmo_steps(const CosmoExperiment& cosmo, const ExperimentPaths& paths) {
  std::vector<Step> steps;
  for (const CosmoSet& set : cosmo.sets) {
    const fs::path graph = paths.graphs / set.graph;
    const fs::path json = cosmo_file(set, paths);
    steps.push_back({.name = cosmo_step_name(set),
                     .title = "COSMO-Bench, " + set.title,
                     .command = {(paths.programs / "kimera_multi_pgo").string(), "solve",
                                 graph.string(), "--json", json.string()},
                     .inputs = {graph},
                     .outputs = {json},
                     .expected_s = 1.0});
    if (!fs::exists(graph))
      steps.back().missing = "no pose graph " + graph.string() + "; --graphs names its folder";
  }
  return steps;
}

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
      step.missing = "no pose graph " + graph.string() + "; --graphs names its folder";
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

// Makes the recording of the world, and runs the robot on it.
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
  steps.pop_back();  // removes the run of the team
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

std::vector<Step> level_steps(const ExperimentConfig& config, const ExperimentPaths& paths) {
  std::vector<Step> steps;
  for (const LevelRun& run : config.level_runs)
    for (Step& step : world_steps(config.world(run.world), paths)) steps.push_back(std::move(step));
  return steps;
}

void append_steps(std::vector<Step>& steps, std::vector<Step> more) {
  for (Step& step : more) {
    const auto same = [&](const Step& other) { return other.name == step.name; };
    if (std::none_of(steps.begin(), steps.end(), same)) steps.push_back(std::move(step));
  }
}

}  // namespace

RecordedFlightFiles find_recorded_flight(const fs::path& place, const std::string& name,
                                         double least_s) {
  RecordedFlightFiles files;
  if (place.empty()) return files;
  const std::vector<fs::path> entries = entries_named(place, name);
  for (const fs::path& entry : entries) {
    if (!fs::is_directory(entry / "mav0")) continue;
    if (files.folder.empty() && recorded_s(entry) >= least_s) files.folder = entry;
    take(entry / "mav0/state_groundtruth_estimate0/data.csv", files.truth);
    take(entry / "mav0/imu0/data.csv", files.imu);
  }
  for (const fs::path& entry : entries) {
    const std::string text = entry.filename().string();
    if (is_table(text)) take(entry, text.find("imu") == text.npos ? files.truth : files.imu);
  }
  return files;
}

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
  return {paths.results / (name + ".json"), paths.results / "figures" / (name + ".html")};
}

std::string cosmo_step_name(const CosmoSet& set) {
  return "cosmo-" + set.stem();
}

fs::path cosmo_file(const CosmoSet& set, const ExperimentPaths& paths) {
  return paths.results / (cosmo_step_name(set) + ".json");
}

fs::path picture_file(const WorldConfig& world, bool corrected, const ExperimentPaths& paths) {
  return paths.results / "figures" /
         ("mesh-" + world.name + (corrected ? "-after.png" : "-before.png"));
}

std::vector<Step> plan_experiment(const std::string& experiment, const ExperimentConfig& config,
                                  const ExperimentPaths& paths) {
  if (experiment == "pcm") return pcm_steps(config.pcm, paths);
  if (experiment == "cosmo") return cosmo_steps(config.cosmo, paths);
  if (experiment == "levels") return level_steps(config, paths);
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
    if (const WorldConfig* run = config.paper_run(name);
        run != nullptr && experiment == "trajectory")
      append_steps(steps, world_steps(*run, paths));
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
