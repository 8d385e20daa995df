#pragma once

#include <array>
#include <optional>
#include <vector>

#include "apps/lab/experiments/experiment_plan.hpp"
#include "modules/evaluation/closure_truth.hpp"

namespace km {

/// A team's run in a world of some level of difficulty.
struct LevelResults {
  std::size_t robots = 0;
  std::size_t in_team_frame = 0;   ///< Robots in the frame of the team.
  std::vector<double> odometry_m;  ///< Absolute trajectory error (RMSE) of each robot's odometry.
  /// Absolute trajectory errors (RMSE) of all robots under one alignment, absent unless all joined.
  /// Before: odometry, placed in the frame of the team by the first optimised keyframe of each
  /// robot. After: as the team published the poses.
  std::optional<double> joint_before_m, joint_after_m;
  /// Median NEES of the published keyframes, see Consistency; absent unless all joined.
  std::optional<double> nees;
  std::size_t closures_kept = 0, false_kept = 0;
  std::array<AngleScore, ClosureScores::kAngleBins> by_angle = {};
  double counted_mb = 0.0;          ///< Sent in the whole run, except for the map.
  double equal_keypoints_mb = 0.0;  ///< See WorldResults.
  double divergences = 0.0;         ///< Divergences of all odometries, which their logs report.

  [[nodiscard]] bool joined() const { return robots > 0 && in_team_frame == robots; }
};

/// Reads the team's tables and trajectories. Throws std::runtime_error naming the file that is
/// missing or invalid.
[[nodiscard]] LevelResults read_level_results(const WorldConfig& world,
                                              const ExperimentPaths& paths);

}  // namespace km
