#include "apps/team/team_results.hpp"

#include <yaml-cpp/yaml.h>

#include <exception>
#include <stdexcept>
#include <utility>

#include "apps/team/team_frame.hpp"
#include "modules/evaluation/closure_files.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/evaluation/trajectory_plot.hpp"
#include "modules/sensors/euroc_reader.hpp"

namespace km {
namespace {

// JSON is YAML; absent keys keep the default.
template <typename T>
void read(const YAML::Node& map, const char* key, T& value) {
  if (map && map.IsMap() && map[key]) value = map[key].as<T>(value);
}

// The part of the recording the robot was given; nullopt for pose graphs.
std::optional<TimeWindow> window_of(const RobotPlan& plan) {
  if (plan.dataset.empty()) return std::nullopt;
  EurocOptions options;
  options.from_s = plan.from_s.value_or(options.from_s);
  options.to_s = plan.to_s.value_or(options.to_s);
  const EurocReader reader(plan.dataset, options);
  return TimeWindow{reader.first_stamp(), reader.last_stamp()};
}

// The left camera of the team: that of the first robot that has one.
std::optional<PinholeCamera> camera_of(const TeamPlan& plan) {
  for (const RobotPlan& robot : plan.robots)
    if (!robot.dataset.empty()) return EurocReader(robot.dataset).rig().stereo.cameras[0];
  return std::nullopt;
}

// Trajectories of the robots, read once: the inputs of the evaluation refer to them.
class Trajectories {
 public:
  explicit Trajectories(const TeamPlan& plan) : plan_(plan) {}

  // The robot's `file` with its truth, if it can be judged; else why not, and nullopt. The result
  // stays valid.
  std::optional<TrajectoryInput> input(const RobotPlan& robot, const char* file,
                                       std::vector<std::string>& notes) try {
    if (robot.truth.empty()) return std::nullopt;
    const auto& truth = read(robot.truth);
    const auto& estimate = read(plan_.output / robot.name / file);
    TrajectoryInput input{robot.name, truth, estimate, window_of(robot)};
    static_cast<void>(trajectory_error({&input, 1}));  // throws if it cannot be compared
    return input;
  } catch (const std::exception& error) {
    notes.emplace_back(error.what());
    return std::nullopt;
  }

  const std::vector<StampedPose>& truth(const RobotPlan& robot) { return read(robot.truth); }

 private:
  const std::vector<StampedPose>& read(const std::filesystem::path& file) {
    const auto known = read_.find(file);
    return known != read_.end() ? known->second
                                : read_.emplace(file, read_trajectory(file)).first->second;
  }

  const TeamPlan& plan_;
  std::map<std::filesystem::path, std::vector<StampedPose>> read_;
};

// The closures of all robots whose truth is known against it; nullopt where there is nothing to
// judge. What keeps a robot out is noted with the team.
std::optional<ClosureScores> judge_closures(const TeamPlan& plan,
                                            const std::vector<RobotResult>& robots,
                                            Trajectories& trajectories,
                                            std::vector<std::string>& notes) try {
  const auto camera = camera_of(plan);
  if (!camera) return std::nullopt;
  std::vector<TrueKeyframe> keyframes;
  std::vector<ClosureRecord> closures;
  for (const RobotResult& result : robots) {
    const RobotPlan& robot = result.plan;
    if (robot.truth.empty() || result.left_nothing()) continue;
    try {
      const auto folder = plan.output / robot.name;
      const auto own =
          place_keyframes(read_keyframes(folder / "keyframes.csv"), trajectories.truth(robot));
      const auto found = read_closures(folder / "loop_closures.csv");
      keyframes.insert(keyframes.end(), own.begin(), own.end());
      closures.insert(closures.end(), found.begin(), found.end());
    } catch (const std::exception& error) {
      notes.push_back(robot.name + ": closures are not judged: " + error.what());
    }
  }
  if (keyframes.empty()) return std::nullopt;
  return score_closures(keyframes, closures, *camera, plan.closure_truth);
} catch (const std::exception& error) {
  notes.emplace_back(error.what());
  return std::nullopt;
}

}  // namespace

RobotSummary read_summary(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file))
    throw std::runtime_error(file.string() + ": no such file");
  RobotSummary summary;
  try {
    const YAML::Node root = YAML::LoadFile(file.string());
    if (!root.IsMap()) throw std::runtime_error(file.string() + ": not a JSON object");
    read(root, "keyframes", summary.keyframes);
    read(root, "frames", summary.frames);
    read(root, "frames_skipped", summary.frames_skipped);
    const YAML::Node closures = root["closures"];
    read(closures, "candidates", summary.closure_candidates);
    read(closures, "verified", summary.closures_verified);
    read(closures, "inliers", summary.closures_inlier);
    const YAML::Node pgo = root["pgo"];
    read(pgo, "rounds", summary.pgo_rounds);
    read(pgo, "seconds", summary.pgo_seconds);
    read(pgo, "cost", summary.pgo_cost);
    if (pgo && pgo.IsMap() && pgo["anchor"]) summary.pgo_anchor = pgo["anchor"].as<RobotId>();
    read(pgo, "members", summary.pgo_members);
    read(root, "traffic", summary.traffic_bytes);
    read(root, "exit_reason", summary.exit_reason);
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
  return summary;
}

TeamResult collect_results(const TeamPlan& plan, std::vector<RobotRun> runs) {
  TeamResult result;
  result.notes = plan.notes;
  Trajectories trajectories(plan);
  for (std::size_t i = 0; i < plan.robots.size(); ++i) {
    RobotResult robot;
    robot.plan = plan.robots[i];
    robot.run = std::move(runs[i]);
    try {
      robot.summary = read_summary(plan.output / robot.plan.name / "summary.json");
    } catch (const std::exception& error) {
      robot.notes.emplace_back(error.what());
    }
    if (const auto input = trajectories.input(robot.plan, "odometry.tum", robot.notes))
      robot.odometry = trajectory_error({&*input, 1}).joint;
    result.robots.push_back(std::move(robot));
  }
  find_team_frame(result.robots);
  TeamPlan joined = plan;
  joined.robots.clear();
  std::vector<TrajectoryInput> optimized;
  for (RobotResult& robot : result.robots) {
    if (!robot.in_team_frame) continue;
    joined.robots.push_back(robot.plan);
    if (const auto input = trajectories.input(robot.plan, "optimized.tum", robot.notes))
      optimized.push_back(*input);
  }
  if (!optimized.empty()) {
    result.optimized = trajectory_error(optimized);
    result.plot = plot_from_above(optimized, *result.optimized);
  }
  if (plan.truth_mesh.empty() || result.optimized)
    result.meshes = collect_meshes(
        joined, result.optimized ? result.optimized->alignment.T_truth_estimate : SE3::Identity(),
        result.notes);
  result.closures = judge_closures(plan, result.robots, trajectories, result.notes);
  return result;
}

}  // namespace km
