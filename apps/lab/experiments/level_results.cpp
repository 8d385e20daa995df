#include "apps/lab/experiments/level_results.hpp"

#include <deque>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "apps/lab/experiments/world_results.hpp"
#include "apps/team/team_file.hpp"
#include "modules/core/json.hpp"
#include "modules/evaluation/association.hpp"
#include "modules/evaluation/consistency.hpp"
#include "modules/evaluation/trajectory_error.hpp"
#include "modules/evaluation/trajectory_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// Trajectories of one robot.
struct RobotPaths {
  std::string name;
  std::vector<StampedPose> truth, odometry;
  UncertainTrajectory keyframes;
};

RobotPaths read_paths(const RobotPlan& plan, const fs::path& run) {
  return {plan.name, read_trajectory(plan.truth), read_trajectory(run / plan.name / "odometry.tum"),
          read_uncertain_trajectory(run / plan.name / "optimized_keyframes.tum")};
}

// Moves the odometry so that its pose at the first keyframe is the optimised one.
bool place_odometry(RobotPaths& paths) {
  if (paths.keyframes.poses.empty()) return false;
  const StampedPose& first = paths.keyframes.poses.front();
  const TrajectoryErrorOptions limits;
  const auto at = pose_at(paths.odometry, first.stamp, limits.max_gap_s, limits.max_difference_s);
  if (!at) return false;
  const SE3 T_team_odom = first.T * at->inverse();
  for (StampedPose& pose : paths.odometry) pose.T = T_team_odom * pose.T;
  return true;
}

void add_joint(const TeamPlan& plan, const WorldFiles& files, LevelResults& results) {
  std::deque<RobotPaths> all;  // inputs refer to them
  std::vector<TrajectoryInput> before;
  std::vector<ConsistencyInput> published;
  for (const RobotPlan& robot : plan.robots) {
    RobotPaths& paths = all.emplace_back(read_paths(robot, files.run));
    if (!place_odometry(paths)) return;
    before.push_back({paths.name, paths.truth, paths.odometry, std::nullopt});
    published.push_back(
        {paths.name, paths.truth, paths.keyframes.poses, paths.keyframes.covariances});
  }
  results.joint_before_m = trajectory_error(before).joint.position_m.rmse;
  results.nees = consistency(published, true).back().median;
}

void add_angles(const Json& team, LevelResults& results) {
  const Json::json_pointer place("/closures/by_angle");
  if (!team.contains(place)) return;
  const Json& bins = team.at(place);
  for (std::size_t k = 0; k < results.by_angle.size() && k < bins.size(); ++k)
    results.by_angle[k] = {bins[k].value("true_pairs", std::size_t{0}),
                           bins[k].value("pairs_found", std::size_t{0})};
}

}  // namespace

LevelResults read_level_results(const WorldConfig& world, const ExperimentPaths& paths) {
  const WorldFiles files = world_files(world, paths);
  const TeamPlan plan = read_team_file(files.team_file, {});
  const Json team = read_json(files.team_json);
  const WorldResults run = read_world_results(world, paths);
  LevelResults results;
  for (const RobotNumbers& robot : run.robots) {
    ++results.robots;
    results.in_team_frame += robot.in_team_frame;
    if (robot.odometry_error_m) results.odometry_m.push_back(*robot.odometry_error_m);
  }
  for (const RobotPlan& robot : plan.robots) {
    const Json summary = read_json(files.run / robot.name / "summary.json");
    results.divergences += number_at(summary, "/odometry/divergences").value_or(0.0);
  }
  results.counted_mb = run.counted_mb();
  results.equal_keypoints_mb = run.equal_keypoints_mb();
  const double kept = run.closures.value_or(0.0);
  results.closures_kept = static_cast<std::size_t>(kept);
  results.false_kept = static_cast<std::size_t>(kept - run.true_closures.value_or(0.0));
  add_angles(team, results);
  if (!results.joined()) return results;
  results.joint_after_m = run.joint_error_m;
  add_joint(plan, files, results);
  return results;
}

}  // namespace km
