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

/// That of the relative pose across a new start, which is hardly known.
[[nodiscard]] Matrix6 restart_covariance();

}  // namespace km
