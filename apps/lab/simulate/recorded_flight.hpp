#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/lab/simulation/dataset/recording_texts.hpp"
#include "apps/lab/simulation/motion/gap_bridge.hpp"
#include "modules/core/frame.hpp"

namespace km {

/// A recorded motion: true states and inertial samples.
struct RecordedFlight {
  std::vector<TrueState> truth;  ///< Velocity and biases are zero if the file has none.
  std::vector<ImuSample> imu;
  BridgedPoses motion;  ///< The true poses, with gaps filled by bridge_gaps().
  std::string
      fingerprint;  ///< Names and check sums of both files, and the corrections of the poses.
};

/// Reads true poses (EuRoC's state CSV, or TUM text with stamps in seconds) and inertial data
/// (EuRoC's CSV); both may be gzipped. Rows that repeat the stamp of the row before are left out,
/// because published truths have some. With `steady` steady_rotations() corrects the poses. Throws
/// std::runtime_error that names file and line for unusable rows, and for files that do not overlap
/// in time.
[[nodiscard]] RecordedFlight read_recorded_flight(const std::filesystem::path& truth,
                                                  const std::filesystem::path& imu,
                                                  bool steady = false);

}  // namespace km
