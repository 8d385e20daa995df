#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "apps/robot/run_summary.hpp"
#include "modules/core/pose_graph.hpp"
#include "modules/diagnosis/finding.hpp"
#include "modules/outlier_rejection/pcm_config.hpp"

namespace km {

/// Why a verified closure is none: in loop_closures.csv.
inline constexpr const char* kRejectedByOptimiser = "rejected: the other closures contradict it";

/// Candidates between two robots, or inside one, by how far they came.
struct ClosureTally {
  std::uint64_t candidates = 0;
  std::uint64_t received = 0;  ///< Both keyframes were at hand.
  std::uint64_t verified = 0;
  std::uint64_t inliers = 0;
  std::uint64_t rejected = 0;                      ///< Of the verified, by the optimiser.
  std::map<std::string, std::uint64_t> unmatched;  ///< Of those received but not verified: why.

  void add(ClosureStage stage, const std::string& reason);
  ClosureTally& operator+=(const ClosureTally& other);
};

/// What a run left of one robot, as far as findings are drawn from it.
struct RunFacts {
  RunSummary summary;
  std::map<RobotId, ClosureTally> closures;  ///< That it found, by the other robot; or itself.
  std::map<RobotId, std::string> names;      ///< Of the robots that it has heard of.
  PcmConfig pcm;
};

/// What stands out in the runs of a team, or of one robot of it; the gravest first. Of two robots
/// that are not in one frame, what both found counts together.
[[nodiscard]] std::vector<Finding> findings_of(std::span<const RunFacts> runs);

/// Of a robot that ended with an exit code other than 0. Drawn at its end; no file tells it later.
[[nodiscard]] Finding failed_run(const std::string& reason);
inline constexpr const char* kFailedRun = "run.failed";

}  // namespace km
