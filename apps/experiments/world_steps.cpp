#include "apps/experiments/world_steps.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "apps/experiments/recorded_flight_files.hpp"
#include "apps/experiments/step_record.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// The simulator notes whether it came to its end.
bool is_complete(const fs::path& simulation_json) try {
  return fs::is_regular_file(simulation_json) &&
         YAML::LoadFile(simulation_json.string())["complete"].as<bool>(false);
} catch (const YAML::Exception&) {
  return false;
}

// Options that make the robots move as recorded; what is not there is noted in the step.
void add_flights(const WorldConfig& world, const ExperimentPaths& paths, Step& step) {
  std::vector<std::string> truths, imus;
  for (const std::string& robot : world.robots) {
    const RecordedFlightFiles flight = find_recorded_flight(paths.euroc, robot);
    if (flight.truth.empty() || flight.imu.empty()) {
      step.missing = "no true poses and inertial data of " + robot +
                     (paths.euroc.empty() ? std::string() : " in " + paths.euroc.string()) +
                     "; --euroc says where EuRoC's recordings are";
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

// Of each robot; nothing if they are not known of all.
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

bool all_exist(const std::vector<fs::path>& files) {
  return std::all_of(files.begin(), files.end(), [](const fs::path& f) { return fs::exists(f); });
}

// A run that was made elsewhere is not repeated: its tables are.
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

}  // namespace

void append(std::vector<std::string>& list, const std::vector<std::string>& more) {
  list.insert(list.end(), more.begin(), more.end());
}

bool has_original_images(const WorldConfig& world, const ExperimentPaths& paths) {
  return world.flights && !paths.euroc.empty() &&
         std::all_of(world.robots.begin(), world.robots.end(), [&](const std::string& robot) {
           return !find_recorded_flight(paths.euroc, robot).folder.empty();
         });
}

std::string simulate_step_name(const WorldConfig& world) {
  return "simulate-" + world.recordings;
}

std::string team_step_name(const WorldConfig& world) {
  return "team-" + world.name;
}

std::vector<Step> world_steps(const WorldConfig& world, const ExperimentPaths& paths) {
  std::vector<Step> steps;
  const bool has_own = world.recordings == world.name;  // else the world that it repeats makes them
  if (has_own && !has_original_images(world, paths)) steps.push_back(simulate_step(world, paths));
  steps.push_back(team_step(world, paths));
  return steps;
}

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
    if (!truths.empty()) {  // they stand the map upright
      step.command.emplace_back("--reference");
      for (const fs::path& truth : truths) step.command.push_back(truth.string());
    }
    append(step.command, world.picture);
    append(step.command, {"--output", picture.string()});
    steps.push_back(std::move(step));
  }
  return steps;
}

}  // namespace km
