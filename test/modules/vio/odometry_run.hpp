#pragma once

#include <vector>

#include "modules/vio/vio.hpp"
#include "recorded_tracking.hpp"

namespace km {

/// What Vio made of a recording.
struct OdometryRun {
  std::vector<OdometryState> states;
  std::vector<SE3> truth;  ///< At the states.
  std::vector<KeyframeOdometry> keyframes;
  std::vector<double> cpu_ms;  ///< Of each process(), this thread.
  std::vector<VioResult> results;
  VioStatistics statistics;
};

/// Runs a fresh Vio over packets `first` to `last` (not included) of `recording`.
OdometryRun run_odometry(const Recording& recording, std::size_t first, std::size_t last,
                         const TrackerConfig& tracker, const VioConfig& config);

}  // namespace km
