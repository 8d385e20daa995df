#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/odometry.hpp"
#include "modules/vio/vio.hpp"
#include "recorded_tracking.hpp"

namespace km {

/// Results of Vio on a recording.
struct OdometryRun {
  std::vector<OdometryState> states;
  std::vector<SE3> truth;  ///< True poses of the states.
  std::vector<KeyframeOdometry> keyframes;
  std::vector<double> cpu_ms;  ///< Processor time of each process() in this thread.
  std::string kernel_share;    ///< Share of a whole call, see test/support/processor_use.hpp.
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

/// `recording` with the stamps of inertial samples `late_s` too late. The calibration of its
/// cameras is rotated by `turned_rad` about [1, 1, 1] of the body against the true one.
Recording disturbed(const Recording& recording, double late_s, double turned_rad);

/// `recording` with images `first` to `last`, not included, black.
Recording darkened(Recording recording, std::size_t first, std::size_t last);

/// Errors of a trajectory against the true poses of the same instants.
struct OdometryErrors {
  double ate_m = 0.0;  ///< Root mean square after SE(3) alignment.
  double max_m = 0.0;  ///< Largest after that alignment.
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
/// lens. The baseline is the same, but virtual. Only every `every`th image has depth, from index
/// `first` on.
[[nodiscard]] Recording as_rgbd(const Recording& recording, std::size_t every = 1,
                                std::size_t first = 0);

}  // namespace km
