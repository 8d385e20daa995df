#pragma once

#include "modules/core/geometry.hpp"
#include "modules/vio/vio_config.hpp"

namespace km {

/// What of a pose is handed on as a keyframe, and how well the way to it is known: the same for
/// every odometry.

/// True if a keyframe is due so long after the one before, and so far from it.
[[nodiscard]] bool is_keyframe_due(const VioConfig& config, double dt_s, const SE3& T_previous_kf);

/// Sigma of a relative pose over `dt_s` that is used: with the drift of which an estimate does not
/// know. Where `Sigma` is no covariance, or too large for an estimate, restart_covariance().
[[nodiscard]] Matrix6 keyframe_covariance(const VioConfig& config, double dt_s,
                                          const Matrix6& Sigma);

/// A stretch of the way that nothing has measured.
struct UnseenWay {
  double lasts_s = 0.0;
  double speed_mps = 0.0;                              ///< Before or after it, the larger.
  Eigen::Vector3d up_body = Eigen::Vector3d::UnitZ();  ///< At its end.
};

/// For how long a body goes on at the speed that it had before `lasts_s` in which nobody knows what
/// it did, and comes at the one it has after them: half of the time, and less of a long one. On
/// five flights and walks of EuRoC and TUM-VI this errs by 0.3 to 0.8 times as much over 1 s as to
/// stand still does, by 0.4 to 1.1 over 2 s, and by 0.9 to 1.5 over 10 s.
[[nodiscard]] double coasting_s(double lasts_s);

/// Of the relative pose across a new start, which is hardly known: the less, the longer nothing was
/// measured and the faster the body was. Heading is known least.
[[nodiscard]] Matrix6 restart_covariance(const UnseenWay& way = {});

}  // namespace km
