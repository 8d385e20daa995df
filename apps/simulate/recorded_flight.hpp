#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "modules/core/frame.hpp"
#include "modules/simulation/dataset/recording_texts.hpp"
#include "modules/simulation/motion/gap_bridge.hpp"

namespace km {

/// A recorded motion: true states and what the inertial sensor measured on the way.
struct RecordedFlight {
  std::vector<TrueState> truth;  ///< Velocity and biases are zero where the file has none.
  std::vector<ImuSample> imu;
  BridgedPoses motion;      ///< The true poses, and those in their gaps as bridge_gaps() has them.
  std::string fingerprint;  ///< Names and check sums of both files, and what was done to poses.
};

/// Reads true poses (EuRoC's state CSV, or TUM text with stamps in seconds) and inertial data
/// (EuRoC's CSV); both may be gzipped. Rows with the stamp of the row before are left out, as
/// published truths have some. With `steady` the poses are as steady_rotations() has them. Throws
/// std::runtime_error that names file and line for rows that cannot be used, and for files that do
/// not overlap in time.
[[nodiscard]] RecordedFlight read_recorded_flight(const std::filesystem::path& truth,
                                                  const std::filesystem::path& imu,
                                                  bool steady = false);

}  // namespace km
