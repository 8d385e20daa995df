#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/vio/vio.hpp"

namespace km {

/// A recording with the true pose of the body at each image.
struct Recording {
  SensorRig rig;
  std::vector<SensorPacket> packets;
  std::vector<SE3> T_world_body;  ///< NaN where the truth has a gap.
};

/// Images of `folder` in the layout of EuRoC, TUM RGB-D or KITTI from `from_s` to `to_s`, with its
/// true poses, if it has any. `imu`: with the inertial sensor, if there is one.
Recording read_recording(const std::filesystem::path& folder, double from_s, double to_s,
                         bool imu = true);

/// Results of Vio on a recording.
struct OdometryRun {
  std::vector<OdometryState> states;
  std::vector<SE3> truth;  ///< True poses of the states.
  std::vector<KeyframeOdometry> keyframes;
  std::vector<VioResult> results;
  VioStatistics statistics;
};

/// Runs a new Vio over packets `first` to `last` (not included) of `recording`. With a `checkpoint`
/// it continues from there.
OdometryRun run_odometry(const Recording& recording, std::size_t first, std::size_t last,
                         const TrackerConfig& tracker, const VioConfig& config,
                         const std::optional<VioCheckpoint>& checkpoint = {});

/// The start of V1_01_easy in `folder`, 4.6 s at rest with idling rotors and five images a second,
/// repeated for `duration_s`.
Recording standing_recording(const std::filesystem::path& folder, double duration_s);

/// `recording` with the stamps of inertial samples `late_s` too late.
Recording delayed(const Recording& recording, double late_s);

/// `recording` with images `first` to `last`, not included, black.
Recording darkened(Recording recording, std::size_t first, std::size_t last);

/// Errors of a trajectory against the true poses of the same instants.
struct OdometryErrors {
  double ate_m = 0.0;  ///< Root mean square after SE(3) alignment.
  double rpe_m = 0.0;  ///< Root mean square over pairs 1 s apart.
  double rpe_deg = 0.0;
  double tilt_deg = 0.0;  ///< Root mean square angle between the verticals, no alignment.
  double scale = 1.0;     ///< Scale of a Sim(3) alignment of the estimate.
};

/// `truth[k]` belongs to `states[k]`; at least three of each.
[[nodiscard]] OdometryErrors odometry_errors(std::span<const OdometryState> states,
                                             std::span<const SE3> truth);

/// `recording` as an RGB-D camera in place of the stereo pair would have recorded it. It has the
/// left images, with depth that StereoDepth computes from both, seen through the left camera's
/// lens. The baseline is the same, but virtual.
[[nodiscard]] Recording as_rgbd(const Recording& recording);

}  // namespace km
