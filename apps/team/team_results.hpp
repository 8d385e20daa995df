#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/team/run_team.hpp"
#include "apps/team/team_file.hpp"
#include "apps/team/team_meshes.hpp"
#include "modules/evaluation/closure_truth.hpp"
#include "modules/evaluation/trajectory_error.hpp"

namespace km {

/// What a robot wrote to summary.json; zero or empty for what it did not write.
struct RobotSummary {
  std::uint64_t keyframes = 0;
  std::uint64_t frames = 0;
  std::uint64_t frames_skipped = 0;
  std::uint64_t closure_candidates = 0;
  std::uint64_t closures_verified = 0;
  std::uint64_t closures_inlier = 0;
  std::uint64_t pgo_rounds = 0;
  double pgo_seconds = 0.0;
  double pgo_cost = 0.0;
  std::optional<RobotId> pgo_anchor;
  std::vector<RobotId> pgo_members;
  std::map<std::string, std::uint64_t> traffic_bytes;  ///< Sent, by category.
  std::string exit_reason;
};

/// Reads summary.json. Throws std::runtime_error naming the file if it is missing or no JSON.
[[nodiscard]] RobotSummary read_summary(const std::filesystem::path& file);

/// One robot after the run. What could not be had is absent, and `notes` say why.
struct RobotResult {
  RobotPlan plan;
  RobotRun run;
  std::optional<RobotSummary> summary;
  std::optional<TrajectoryError> odometry;  ///< Aligned alone.
  bool in_team_frame = true;                ///< Its optimised poses are, see find_team_frame().
  std::vector<std::string> notes;

  /// True if it failed before it wrote results: why is in its last words.
  [[nodiscard]] bool left_nothing() const { return !summary && !run.exit.ok(); }
};

/// A team after the run.
struct TeamResult {
  std::vector<RobotResult> robots;
  std::optional<TeamError> optimized;  ///< Of the robots in the team's frame, under one alignment.
  std::string plot;                    ///< SVG of `optimized` from above; empty without it.
  std::optional<ClosureScores> closures;  ///< Of robots with cameras, where the truth is known.
  TeamMeshes meshes;                      ///< Of robots that made a map.
  std::vector<std::string> notes;         ///< Why something of the team is absent.
};

/// Collects the results of a run: summaries, and errors where the truth is known. Completeness is
/// that of the part of the recording the robot was given. The true poses of all robots are in one
/// world: closures are judged in it, with the left camera of the first robot's recording. Never
/// throws for what a robot left out.
[[nodiscard]] TeamResult collect_results(const TeamPlan& plan, std::vector<RobotRun> runs);

}  // namespace km
