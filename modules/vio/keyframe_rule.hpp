#pragma once

#include <optional>

#include "modules/core/data/odometry.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/vio/vio_config.hpp"

namespace km {

/// Rules for publishing keyframes and for the covariance of their relative poses, common to all
/// odometries.

/// True if a keyframe is due `dt_s` after the previous keyframe, at pose `T_previous_kf` from it.
[[nodiscard]] bool is_keyframe_due(const VioConfig& config, double dt_s, const SE3& T_previous_kf);

/// Covariance of a relative pose over `dt_s`: `Sigma` plus the drift that an estimate cannot know.
/// restart_covariance() if `Sigma` is not a covariance or is too large for an estimate.
[[nodiscard]] Matrix6 keyframe_covariance(const VioConfig& config, double dt_s,
                                          const Matrix6& Sigma);

/// An interval of the motion without measurements.
struct UnmeasuredMotion {
  double lasts_s = 0.0;
  double speed_mps = 0.0;  ///< The larger of the speeds before and after the interval.
  /// Vertical at the end of the interval; nullopt without an inertial sensor.
  std::optional<Eigen::Vector3d> up_body = Eigen::Vector3d::UnitZ();
};

/// Time for which a body is assumed to continue at its former speed, and then at its later speed,
/// in an interval of `lasts_s` without measurements. This time is half of the interval, and less if
/// the interval is long. The error was compared with that of assuming standstill, on five flights
/// and walks of EuRoC and TUM-VI. The ratio of the two errors is 0.3 to 0.8 over 1 s, 0.4 to 1.1
/// over 2 s, and 0.9 to 1.5 over 10 s.
[[nodiscard]] double coasting_s(double lasts_s);

/// Covariance of the relative pose across a new start. The covariance grows with the duration
/// without measurements and with the speed. The heading is more uncertain than roll and pitch,
/// unless the vertical is unknown.
[[nodiscard]] Matrix6 restart_covariance(const UnmeasuredMotion& motion = {});

/// Origin of the odometry of a run in the frame of the published keyframes, if `last` is the last
/// keyframe of another run. It is far from that run: no map may fuse surfaces of the two, whose
/// relative pose is unknown.
[[nodiscard]] SE3 chain_of_next_run(const KeyframeOdometry& last);

/// Covariance of the relative pose between two runs: only the tilt is known. `up_body`: vertical at
/// the second pose; nullopt: the tilt is unknown too.
[[nodiscard]] Matrix6 unknown_step_covariance(const std::optional<Eigen::Vector3d>& up_body);

}  // namespace km
