#include "apps/team/team_results.hpp"

#include <algorithm>
#include <exception>
#include <filesystem>
#include <iostream>
#include <map>
#include <span>
#include <system_error>
#include <utility>

#include "modules/core/io/input_file.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "modules/sensors/node/open_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// The result of `make`; nullopt if it throws, with the reason in the notes.
auto attempt(std::vector<std::string>& notes, const auto& make, const std::string& what = {})
    -> std::optional<decltype(make())> {
  try {
    return make();
  } catch (const std::exception& error) {
    notes.push_back(what + error.what());
    return std::nullopt;
  }
}

// Meshes by robot, in the order of the plan, without the robots that wrote no mesh.
using Meshes = std::vector<std::pair<std::string, LabelledMesh>>;

Meshes read_meshes(const TeamPlan& plan, const char* file, std::vector<std::string>& notes) {
  Meshes meshes;
  for (const RobotPlan& robot : plan.robots) {
    const fs::path path = plan.output / robot.name / file;
    if (!is_there(path)) continue;
    auto mesh = attempt(notes, [&] { return read_mesh(path); });
    if (mesh && mesh->faces.empty())
      notes.push_back(path.string() + ": the mesh is empty");
    else if (mesh)
      meshes.emplace_back(robot.name, std::move(*mesh));
  }
  return meshes;
}

// Without a limit, the comparison for a city would take longer than the run. kimera_multi_evaluate
// mesh takes more samples.
constexpr std::size_t kMostSamples = 2'000'000;

std::vector<MeshInput> inputs_of(const Meshes& meshes) {
  std::vector<MeshInput> inputs;
  for (const auto& [name, mesh] : meshes) inputs.push_back({name, mesh});
  return inputs;
}

// Removes the robots of `meshes` that `others` lacks, each with a note that ends in `problem`.
void keep_common(Meshes& meshes, const Meshes& others, const char* problem,
                 std::vector<std::string>& notes) {
  std::erase_if(meshes, [&](const auto& mesh) {
    const bool is_alone =
        std::ranges::find(others, mesh.first, &Meshes::value_type::first) == others.end();
    if (is_alone) notes.push_back(mesh.first + problem);
    return is_alone;
  });
}

// Both states on the same points of the truth.
std::optional<MeshChange> compare(const LabelledMesh& truth, Meshes before, Meshes after,
                                  const SE3& T_truth_team, std::vector<std::string>& notes) {
  keep_common(before, after, " left a mesh, but none corrected: not compared", notes);
  keep_common(after, before, " left a corrected mesh, but no other: not compared", notes);
  if (before.empty()) return std::nullopt;
  MeshErrorOptions options;
  options.T_truth_estimate = T_truth_team;
  options.max_samples = kMostSamples;
  return attempt(
      notes, [&] { return mesh_change(truth, inputs_of(before), inputs_of(after), options); },
      "meshes are not compared: ");
}

// Left camera of the team: that of the first robot with a camera.
std::optional<Camera> camera_of(const TeamPlan& plan) {
  for (const RobotPlan& robot : plan.robots)
    if (!robot.dataset.empty())
      return open_folder(robot.dataset, {}, argument_of(robot, "--rig")).rig().stereo.cameras[0];
  return std::nullopt;
}

// Trajectories of the robots, read once, because the inputs of the evaluation refer to them.
class Trajectories {
 public:
  explicit Trajectories(const TeamPlan& plan) : plan_(plan) {}

  // The robot's `file` with its truth if it can be compared; otherwise nullopt, with the reason in
  // the notes. The result stays valid.
  std::optional<TrajectoryInput> input(const RobotPlan& robot, const char* file,
                                       std::vector<std::string>& notes) {
    if (robot.truth.empty()) return std::nullopt;
    return attempt(notes, [&] {
      const auto& truth = read(robot.truth);
      const auto& estimate = read(plan_.output / robot.name / file);
      TrajectoryInput input{robot.name, truth, estimate, recorded_window(robot)};
      static_cast<void>(trajectory_error({&input, 1}));  // throws if there is nothing to compare
      return input;
    });
  }

  const std::vector<StampedPose>& truth(const RobotPlan& robot) { return read(robot.truth); }

  const std::vector<StampedPose>& optimized(const RobotPlan& robot) {
    return read(plan_.output / robot.name / "optimized.tum");
  }

 private:
  const std::vector<StampedPose>& read(const fs::path& file) {
    const auto known = read_.find(file);
    return known != read_.end() ? known->second
                                : read_.emplace(file, read_trajectory(file)).first->second;
  }

  const TeamPlan& plan_;
  std::map<fs::path, std::vector<StampedPose>> read_;
};

std::vector<StampedPose> moved(std::span<const StampedPose> poses, const SE3& T_truth_estimate) {
  std::vector<StampedPose> result(poses.begin(), poses.end());
  for (StampedPose& pose : result) pose.T = T_truth_estimate * pose.T;
  return result;
}

// The part of the truth that an estimate covers.
std::vector<StampedPose> beside(std::span<const StampedPose> truth,
                                std::span<const StampedPose> estimate) {
  std::vector<StampedPose> result;
  for (const StampedPose& pose : truth)
    if (!estimate.empty() && pose.stamp >= estimate.front().stamp &&
        pose.stamp <= estimate.back().stamp)
      result.push_back(pose);
  return result;
}

void judge_odometry(const TrajectoryInput& input, RobotResult& robot) {
  const TeamError error = trajectory_error({&input, 1});
  robot.odometry = error.joint;
  robot.paths.odometry = moved(input.estimate, error.T_truth_estimate);
  robot.paths.truth = beside(input.truth, input.estimate);
}

// Error of `file` of the `robots` under one alignment; nullopt if there is nothing to compare. The
// notes of a robot say why its poses are missing.
std::optional<TeamError> joint_error(std::span<RobotResult* const> robots,
                                     Trajectories& trajectories, const char* file) {
  std::vector<TrajectoryInput> inputs;
  for (RobotResult* robot : robots)
    if (const auto input = trajectories.input(robot->plan, file, robot->notes))
      inputs.push_back(*input);
  return inputs.empty() ? std::nullopt : std::optional(trajectory_error(inputs));
}

// Compares the live and the optimised poses of the robots in the team's frame with the truth, and
// moves the optimised ones to the frame of the truth. A robot that entered this frame at the end
// has no live poses in it, and its file is empty.
void judge_in_team_frame(const TeamPlan& plan, TeamResult& team, Trajectories& trajectories) {
  std::vector<RobotResult*> joined, live;
  for (RobotResult& robot : team.robots) {
    if (!robot.in_team_frame) continue;
    joined.push_back(&robot);
    std::error_code missing;
    const auto size = fs::file_size(plan.output / robot.plan.name / "live.tum", missing);
    if (!missing && size > 0) live.push_back(&robot);
  }
  team.optimized = joint_error(joined, trajectories, "optimized.tum");
  team.live = joint_error(live, trajectories, "live.tum");
  const SE3 T_truth_estimate = team.optimized ? team.optimized->T_truth_estimate : SE3::Identity();
  for (RobotResult& robot : team.robots) {
    if (!robot.in_team_frame || robot.left_nothing()) continue;
    std::vector<std::string>
        known;  // not reported: the comparison has noted the reason, or there is no truth
    const auto poses = attempt(known, [&] { return trajectories.optimized(robot.plan); });
    if (poses) robot.paths.optimized = moved(*poses, T_truth_estimate);
  }
}

// Reads keyframes and closures. The team's notes say why those of a robot are missing.
void read_all_closures(const TeamPlan& plan, std::vector<RobotResult>& robots,
                       std::vector<std::string>& notes) {
  for (RobotResult& robot : robots) {
    const auto folder = plan.output / robot.plan.name;
    const bool expected =
        !robot.plan.truth.empty() && !robot.plan.dataset.empty() && !robot.left_nothing();
    if (!expected && !is_there(folder / "loop_closures.csv")) continue;
    try {
      auto keyframes = read_keyframes(folder / "keyframes.csv");
      robot.closures = read_closures(folder / "loop_closures.csv");
      robot.keyframes = std::move(keyframes);
    } catch (const std::exception& error) {
      notes.push_back(robot.plan.name + ": closures are not judged: " + error.what());
    }
  }
}

// Compares the closures of all robots with a known truth; nullopt if there is nothing to compare.
std::optional<ClosureScores> judge_closures(const TeamPlan& plan,
                                            const std::vector<RobotResult>& robots,
                                            Trajectories& trajectories,
                                            std::vector<std::string>& notes) try {
  const auto camera = camera_of(plan);
  if (!camera) return std::nullopt;
  std::vector<TrueKeyframe> keyframes;
  std::vector<ClosureRecord> closures;
  for (const RobotResult& robot : robots) {
    if (robot.plan.truth.empty() || robot.keyframes.empty()) continue;
    try {
      const auto own = place_keyframes(robot.keyframes, trajectories.truth(robot.plan));
      keyframes.insert(keyframes.end(), own.begin(), own.end());
      closures.insert(closures.end(), robot.closures.begin(), robot.closures.end());
    } catch (const std::exception& error) {
      notes.push_back(robot.plan.name + ": closures are not judged: " + error.what());
    }
  }
  if (keyframes.empty()) return std::nullopt;
  return score_closures(keyframes, closures, *camera, plan.closure_truth);
} catch (const std::exception& error) {
  notes.emplace_back(error.what());
  return std::nullopt;
}

}  // namespace

fs::path argument_of(const RobotPlan& plan, const std::string& option) {
  const auto found = std::ranges::find(plan.arguments, option);
  if (found != plan.arguments.end() && std::next(found) != plan.arguments.end())
    return *std::next(found);
  for (const std::string& word : plan.arguments)
    if (word.starts_with(option + "=")) return word.substr(option.size() + 1);
  return {};
}

std::optional<RobotId> frame_of(const RobotResult& robot) {
  if (!robot.summary) return std::nullopt;
  const OptimizerProgress& pgo = robot.summary->pgo;
  return pgo.members.size() > 1 ? pgo.anchor : robot.plan.id;
}

std::optional<TimeWindow> recorded_window(const RobotPlan& plan) {
  if (plan.dataset.empty()) return std::nullopt;
  FolderOptions options;
  options.part.from_s = plan.from_s.value_or(options.part.from_s);
  options.part.to_s = plan.to_s.value_or(options.part.to_s);
  const FolderReader reader = open_folder(plan.dataset, options, argument_of(plan, "--rig"));
  const std::vector<StereoPairFile>& frames = reader.folder().frames;
  return TimeWindow{frames.front().stamp, frames.back().stamp};
}

void find_team_frame(std::vector<RobotResult>& robots) {
  std::map<RobotId, int> sizes;
  for (const RobotResult& robot : robots)
    if (const auto frame = frame_of(robot)) ++sizes[*frame];
  // Among equal sizes max_element takes the first: the lowest anchor.
  const auto team = std::max_element(
      sizes.begin(), sizes.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  for (RobotResult& robot : robots) {
    const auto frame = frame_of(robot);
    if (!frame || *frame == team->first) continue;
    robot.in_team_frame = false;
    robot.notes.push_back((*frame == robot.plan.id && sizes[*frame] == 1
                               ? std::string(robots.size() == 2 ? "never joined the other robot"
                                                                : "never joined the others")
                               : "ended in the frame of robot " + std::to_string(*frame)) +
                          ": left out of the live and optimised errors, the report's trajectories "
                          "and the team's map");
  }
}

TeamMeshes collect_meshes(const TeamPlan& plan, const SE3& T_truth_team,
                          std::vector<std::string>& notes) {
  TeamMeshes result;
  Meshes before = read_meshes(plan, "mesh.ply", notes);
  Meshes after = read_meshes(plan, "mesh_optimized.ply", notes);
  for (const auto& [name, mesh] : after) result.merged.append(mesh);
  result.merged.transform(T_truth_team);
  if (plan.truth_mesh.empty() || before.empty()) return result;
  std::cerr << "comparing the meshes with " << plan.truth_mesh.string() << " ...\n";
  const auto truth = attempt(notes, [&] { return read_mesh(plan.truth_mesh); });
  if (!truth) return result;
  result.errors = compare(*truth, std::move(before), std::move(after), T_truth_team, notes);
  return result;
}

TeamResult collect_results(const TeamPlan& plan, std::vector<RobotRun> runs) {
  TeamResult result;
  result.notes = plan.notes;
  Trajectories trajectories(plan);
  for (std::size_t i = 0; i < plan.robots.size(); ++i) {
    RobotResult& robot = result.robots.emplace_back();
    robot.plan = plan.robots[i];
    robot.run = std::move(runs[i]);
    const fs::path summary = plan.output / robot.plan.name / "summary.json";
    robot.summary = attempt(robot.notes, [&] { return read_summary(summary); });
    if (const auto input = trajectories.input(robot.plan, "odometry.tum", robot.notes))
      judge_odometry(*input, robot);
  }
  find_team_frame(result.robots);
  TeamPlan joined = plan;
  joined.robots.clear();
  for (const RobotResult& robot : result.robots)
    if (robot.in_team_frame) joined.robots.push_back(robot.plan);
  judge_in_team_frame(plan, result, trajectories);
  if (plan.truth_mesh.empty() || result.optimized)
    result.meshes = collect_meshes(
        joined, result.optimized ? result.optimized->T_truth_estimate : SE3::Identity(),
        result.notes);
  read_all_closures(plan, result.robots, result.notes);
  result.closures = judge_closures(plan, result.robots, trajectories, result.notes);
  return result;
}

}  // namespace km
