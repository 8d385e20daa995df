#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/robot/run_summary.hpp"
#include "apps/team/run_team.hpp"
#include "apps/team/team_file.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/evaluation/closure_truth.hpp"
#include "modules/evaluation/mesh/mesh_error.hpp"
#include "modules/evaluation/trajectory_error.hpp"

namespace km {

/// Paths of a robot over the time of its estimate. With a truth they are in its world: the odometry
/// aligned alone, the optimised poses aligned as a team. Without a truth, only `optimized` is set,
/// in the team's frame. Missing paths are empty.
struct RobotPaths {
  std::vector<StampedPose> truth, odometry, optimized;
};

/// Results of one robot after the run. Missing ones are absent, and `notes` say why.
struct RobotResult {
  RobotPlan plan;
  RobotRun run;
  std::optional<RunSummary> summary;
  std::optional<TrajectoryError> odometry;  ///< Aligned alone.
  bool in_team_frame =
      true;  ///< True if its optimised poses are in the team's frame, see find_team_frame().
  RobotPaths paths;
  std::vector<KeyframeRecord> keyframes;  ///< Keyframes of a robot with cameras.
  std::vector<ClosureRecord> closures;    ///< Candidates that a robot with cameras considered.
  std::vector<std::string> notes;

  /// True if the robot failed before it wrote results; its last log lines have the reason.
  [[nodiscard]] bool left_nothing() const { return !summary && !run.exit.ok(); }
};

/// The meshes of a team after the run.
struct TeamMeshes {
  /// Errors of mesh.ply and of mesh_optimized.ply, of the robots that have both; absent if the
  /// truth is unknown.
  std::optional<MeshChange> errors;
  LabelledMesh merged;  ///< All mesh_optimized.ply in the frame of the truth; may be empty.
};

/// A team after the run.
struct TeamResult {
  std::vector<RobotResult> robots;
  std::optional<TeamError>
      optimized;  ///< Error of the robots in the team's frame, under one alignment.
  std::optional<TeamError>
      live;  ///< Like `optimized`, of the poses as known when each image came (live.tum).
  std::optional<ClosureScores>
      closures;       ///< Scores for robots with cameras; absent if the truth is unknown.
  TeamMeshes meshes;  ///< Meshes of the robots that built a map.
  std::vector<std::string> notes;  ///< Reasons why results of the team are absent.
};

/// The value of `option` on the command line of the robot; empty if it is not there.
[[nodiscard]] std::filesystem::path argument_of(const RobotPlan& plan, const std::string& option);

/// Part of the recording that the robot plays; nullopt for pose graphs. Throws the exceptions of
/// open_folder().
[[nodiscard]] std::optional<TimeWindow> recorded_window(const RobotPlan& plan);

/// Robot whose odometry frame the optimised poses of `robot` are in: itself if it optimised alone;
/// nullopt if it left no summary.
[[nodiscard]] std::optional<RobotId> frame_of(const RobotResult& robot);

/// Finds the team's frame: that of the optimised poses of most robots. If several frames are
/// equally common, that of the lowest anchor counts. Sets `in_team_frame` of the robots in other
/// frames to false and notes why. A robot without a summary is assumed to be in the team's frame.
void find_team_frame(std::vector<RobotResult>& robots);

/// Reads the meshes of the robots and merges them in the frame of the true poses, to which
/// `T_truth_team` leads. Compares them with `plan.truth_mesh`, to which ICP aligns all of them
/// together: once those of odometry and once the optimised ones. Missing meshes of robots that
/// built a map are noted.
[[nodiscard]] TeamMeshes collect_meshes(const TeamPlan& plan, const SE3& T_truth_team,
                                        std::vector<std::string>& notes);

/// Collects the results of a run: summaries, and errors if the truth is known. Completeness refers
/// to the part of the recording that the robot plays. The true poses of all robots are in one
/// world, in which closures are judged, with the left camera of the first robot's recording. Never
/// throws for missing results of a robot.
[[nodiscard]] TeamResult collect_results(const TeamPlan& plan, std::vector<RobotRun> runs);

}  // namespace km
