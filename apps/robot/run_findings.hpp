#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "apps/robot/run_summary.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/diagnosis/finding.hpp"
#include "modules/outlier_rejection/pcm_config.hpp"

namespace km {

/// Reason in loop_closures.csv for a verified closure that the optimiser rejected.
inline constexpr const char* kRejectedByOptimiser = "rejected: the other closures contradict it";

/// Number of candidates between two robots, or inside one, by the stage they reached.
struct ClosureTally {
  std::uint64_t candidates = 0;
  std::uint64_t received = 0;  ///< Candidates with both keyframes available.
  std::uint64_t verified = 0;
  std::uint64_t inliers = 0;
  std::uint64_t rejected = 0;  ///< Verified closures that the optimiser rejected.
  std::map<std::string, std::uint64_t>
      unmatched;  ///< Received but unverified candidates, by reason.

  void add(ClosureStage stage, const std::string& reason);
  ClosureTally& operator+=(const ClosureTally& other);
};

/// Results of one robot from which findings are drawn.
struct RunFacts {
  RunSummary summary;
  std::map<RobotId, ClosureTally> closures;  ///< Closures found by this robot, by the other robot;
                                             ///< own closures under its own id.
  std::map<RobotId, std::string> names;      ///< Names of the robots that it knows.
  PcmConfig pcm;
};

/// Findings on the runs of a team, or of one robot of it; the gravest first. For two robots without
/// a common frame, the closures that each of them found are added.
[[nodiscard]] std::vector<Finding> findings_of(std::span<const RunFacts> runs);

/// Finding for a robot that ended with an exit code other than 0. It is drawn when the robot ends,
/// because no result file has the reason.
[[nodiscard]] Finding failed_run(const std::string& reason);
inline constexpr const char* kFailedRun = "run.failed";

}  // namespace km
