#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/robot/run_summary.hpp"
#include "apps/team/run_team.hpp"
#include "apps/team/team_file.hpp"
#include "modules/core/geometry.hpp"
#include "modules/evaluation/closure_truth.hpp"
#include "modules/evaluation/mesh/mesh_error.hpp"
#include "modules/evaluation/trajectory_error.hpp"

namespace km {

/// Where a robot was, over the time of its estimate: in the world of the truth, if there is one,
/// the odometry aligned alone and the optimised poses as the team is; else `optimized` alone, in
/// the team's frame. What there is not is empty.
struct RobotPaths {
  std::vector<StampedPose> truth, odometry, optimized;
};

/// One robot after the run. What could not be had is absent, and `notes` say why.
struct RobotResult {
  RobotPlan plan;
  RobotRun run;
  std::optional<RunSummary> summary;
  std::optional<TrajectoryError> odometry;  ///< Aligned alone.
  bool in_team_frame = true;                ///< Its optimised poses are, see find_team_frame().
  RobotPaths paths;
  std::vector<KeyframeRecord> keyframes;  ///< Of a robot with cameras.
  std::vector<ClosureRecord> closures;    ///< That it considered, likewise.
  std::vector<std::string> notes;

  /// True if it failed before it wrote results: why is in its last words.
  [[nodiscard]] bool left_nothing() const { return !summary && !run.exit.ok(); }
};

/// The meshes of a team after the run.
struct TeamMeshes {
  std::optional<MeshReport> odometry;   ///< Of mesh.ply; absent if the truth is unknown.
  std::optional<MeshReport> optimized;  ///< Of mesh_optimized.ply, likewise.
  LabelledMesh merged;                  ///< All mesh_optimized.ply as one, moved; may be empty.
};

/// A team after the run.
struct TeamResult {
  std::vector<RobotResult> robots;
  std::optional<TeamError> optimized;  ///< Of the robots in the team's frame, under one alignment.
  std::optional<ClosureScores> closures;  ///< Of robots with cameras, where the truth is known.
  TeamMeshes meshes;                      ///< Of robots that made a map.
  std::vector<std::string> notes;         ///< Why something of the team is absent.
};

/// The part of the recording that the robot is given; nullopt for pose graphs. Throws what
/// EurocReader throws.
[[nodiscard]] std::optional<TimeWindow> recorded_window(const RobotPlan& plan);

/// The robot whose odometry frame a robot's optimised poses are in, itself if it solved with no
/// other; nullopt if it left no summary.
[[nodiscard]] std::optional<RobotId> frame_of(const RobotResult& robot);

/// Finds the robots whose optimised poses are not in the frame that most robots ended in (of
/// equally many, that of the lowest anchor): sets `in_team_frame` of these to false and notes why.
/// A robot that left no summary is taken to be in it.
void find_team_frame(std::vector<RobotResult>& robots);

/// Reads the meshes that the robots left, merges them in the frame of the true poses, to which
/// `T_truth_team` leads, and compares them with `plan.truth_mesh`: there ICP brings all together
/// onto it, in each of the two cases. What is missing of the robots that made a map is noted.
[[nodiscard]] TeamMeshes collect_meshes(const TeamPlan& plan, const SE3& T_truth_team,
                                        std::vector<std::string>& notes);

/// Collects the results of a run: summaries, and errors where the truth is known. Completeness is
/// that of the part of the recording the robot was given. The true poses of all robots are in one
/// world: closures are judged in it, with the left camera of the first robot's recording. Never
/// throws for what a robot left out.
[[nodiscard]] TeamResult collect_results(const TeamPlan& plan, std::vector<RobotRun> runs);

}  // namespace km
