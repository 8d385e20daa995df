#include "apps/lab/experiments/world_results.hpp"

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "apps/centralised_system.hpp"
#include "apps/team/team_file.hpp"
#include "modules/core/text_rows.hpp"
#include "modules/evaluation/trajectory_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

std::optional<double> scaled(const std::optional<double>& value, double factor) {
  return value ? std::optional<double>(factor * *value) : std::nullopt;
}

MeshNumbers mesh_numbers(const Json& mesh) {
  return {number_at(mesh, "/truth_to_estimate/point/mean_m"),
          number_at(mesh, "/seen_truth_to_estimate/point/mean_m"),
          scaled(number_at(mesh, "/truth_to_estimate/labels/accuracy"), 100.0),
          scaled(number_at(mesh, "/seen_truth_to_estimate/labels/accuracy"), 100.0),
          number_at(mesh, "/estimate_to_truth/point/mean_m")};
}

// A part of the document; null if absent.
Json part_of(const Json& json, const char* pointer) {
  const Json::json_pointer at(pointer);
  return json.contains(at) ? json.at(at) : Json();
}

// The entry with this name in a list of objects; empty if there is none.
Json named(const Json& json, const char* list, const std::string& name) {
  for (const Json& entry : part_of(json, list))
    if (entry.value("name", "") == name) return entry;
  return Json::object();
}

MeshPair mesh_of(const Json& team, const std::string& robot) {
  return {mesh_numbers(named(team, "/meshes/robots", robot)),
          mesh_numbers(named(team, "/optimized_meshes/robots", robot))};
}

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::map<std::string, double> module_seconds(const fs::path& timing) {
  const std::string text = text_of(timing);
  std::map<std::string, double> seconds;
  for (const TextRow& row : split_rows(text))
    if (row.fields.size() >= 6)
      if (const auto total_s = parse_double(row.fields[5]))
        seconds[std::string(row.fields[0])] = *total_s;
  return seconds;
}

void add_truth(const fs::path& truth, RobotNumbers& robot) {
  if (truth.empty()) return;
  const std::vector<StampedPose> poses = read_trajectory(truth);
  for (std::size_t i = 1; i < poses.size(); ++i)
    robot.distance_m += (poses[i].T.translation() - poses[i - 1].T.translation()).norm();
  robot.recorded_s = 1e-9 * static_cast<double>(poses.back().stamp - poses.front().stamp);
}

// Adds processor time and memory of the robot.
void add_process(const fs::path& run, const Json& summary, RobotNumbers& robot) {
  robot.module_s = module_seconds(run / "timing.csv");
  const double cpu_s = number_at(summary, "/process/cpu_s").value_or(0.0);
  if (!(cpu_s > 0.0)) return;  // the run is from an older version without these values
  robot.processor_s = cpu_s;
  robot.peak_memory_mb = scaled(number_at(summary, "/process/peak_memory_bytes"), 1e-6);
}

RobotNumbers read_robot(const Json& team, const RobotPlan& plan, const fs::path& run) {
  const Json summary = read_json(run / plan.name / "summary.json");
  RobotNumbers robot;
  robot.name = plan.name;
  add_truth(plan.truth, robot);
  const Json own = named(team, "/robots", plan.name);
  const double keyframes = number_at(summary, "/keyframes").value_or(0.0);
  robot.keyframes = static_cast<std::size_t>(keyframes);
  robot.in_team_frame = own.value("in_team_frame", true);
  robot.odometry_error_m = number_at(own, "/odometry/position_m/rmse");
  robot.optimized_error_m =
      number_at(named(team, "/optimized/robots", plan.name), "/position_m/rmse");
  const Json traffic = part_of(summary, "/traffic");
  for (const auto& [category, bytes] : traffic.items())
    if (bytes.is_number()) robot.sent_bytes[category] = bytes.get<double>();
  add_process(run / plan.name, summary, robot);
  const double keypoints = number_at(summary, "/keypoints").value_or(0.0);
  if (keypoints > 0.0 && keyframes > 0.0)
    robot.keyframe_bytes = keypoints * kKeypointBytes / keyframes;
  robot.peer_keyframes = number_at(summary, "/peer_keyframes/keyframes").value_or(0.0);
  robot.peer_keypoints = number_at(summary, "/peer_keyframes/keypoints").value_or(0.0);
  robot.mesh = mesh_of(team, plan.name);
  return robot;
}

void describe_images(const WorldFiles& files, WorldResults& results) {
  constexpr std::size_t kEuRocPixels = 752 * 480;
  results.image_pixels = kEuRocPixels;
  results.images = "EuRoC's images, 752x480";
  if (files.original) return;
  const Json parameters = part_of(read_json(files.recordings / "simulation.json"), "/parameters");
  if (!parameters.is_object()) return;
  const std::string resolution = parameters.value("resolution", "752x480");
  std::istringstream size(resolution);
  std::size_t width = 0, height = 0;
  char cross = 0;
  if (size >> width >> cross >> height) results.image_pixels = width * height;
  results.images = resolution + ", " + parameters.value("rig", "stereo") + ", seed " +
                   parameters.value("seed", "?");
}

}  // namespace

std::size_t WorldResults::keyframes() const {
  std::size_t sum = 0;
  for (const RobotNumbers& robot : robots) sum += robot.keyframes;
  return sum;
}

double WorldResults::sent_mb(const std::string& category) const {
  double bytes = 0.0;
  for (const RobotNumbers& robot : robots)
    if (const auto found = robot.sent_bytes.find(category); found != robot.sent_bytes.end())
      bytes += found->second;
  return 1e-6 * bytes;
}

double WorldResults::counted_mb() const {
  double bytes = 0.0;
  for (const RobotNumbers& robot : robots) bytes += counted_bytes(robot.sent_bytes);
  return 1e-6 * bytes;
}

double WorldResults::equal_keypoints_mb() const {
  double received = 0.0, keypoints = 0.0;
  for (const RobotNumbers& robot : robots) {
    received += robot.peer_keyframes;
    keypoints += robot.peer_keypoints;
  }
  if (received == 0.0) return 0.0;
  return 1e-6 * server_bytes(static_cast<double>(keyframes()), keypoints / received);
}

RobotNumbers read_lone_robot(const fs::path& run) {
  RobotNumbers robot;
  add_process(run, read_json(run / "summary.json"), robot);
  const std::vector<StampedPose> poses = read_trajectory(run / "odometry.tum");
  if (poses.empty()) throw std::runtime_error((run / "odometry.tum").string() + ": no poses");
  robot.recorded_s = 1e-9 * static_cast<double>(poses.back().stamp - poses.front().stamp);
  return robot;
}

WorldResults read_world_results(const WorldConfig& world, const ExperimentPaths& paths) {
  const WorldFiles files = world_files(world, paths);
  const TeamPlan plan = read_team_file(files.team_file, {});
  const Json team = read_json(files.team_json);
  WorldResults results;
  for (const RobotPlan& robot : plan.robots)
    results.robots.push_back(read_robot(team, robot, files.run));
  results.joint_error_m = number_at(team, "/optimized/joint/position_m/rmse");
  results.live_error_m = number_at(team, "/live/joint/position_m/rmse");
  results.mesh = {mesh_numbers(part_of(team, "/meshes/merged")),
                  mesh_numbers(part_of(team, "/optimized_meshes/merged"))};
  results.closures = number_at(team, "/closures/inliers/judged");
  results.true_closures = number_at(team, "/closures/inliers/correct");
  describe_images(files, results);
  return results;
}

}  // namespace km
