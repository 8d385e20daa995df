#include "modules/vio/keyframe_rule.hpp"

#include "modules/core/covariance.hpp"
#include "modules/core/lie.hpp"

namespace km {
namespace {

// Standard deviations [rad], [m].
constexpr double kRestartRotation = 0.3;
constexpr double kRestartTranslation = 1.0;

// Of a relative pose between keyframes, each axis, in [rad^2] and [m^2]: no sensor knows one better
// than to a microradian and a micrometre, and what is worse than the most is no estimate.
constexpr double kLeastVariance = 1e-12;
constexpr double kMostVariance = 1e6;

}  // namespace

bool is_keyframe_due(const VioConfig& config, double dt_s, const SE3& T_previous_kf) {
  if (dt_s < config.output_interval_s - 1e-3) return false;
  return dt_s >= config.output_rest_interval_s ||
         T_previous_kf.translation().norm() >= config.output_distance_m ||
         angle_of(T_previous_kf.linear()) >= config.output_rotation_rad;
}

Matrix6 keyframe_covariance(const VioConfig& config, double dt_s, const Matrix6& Sigma) {
  if (!is_covariance(Sigma) || Sigma.diagonal().maxCoeff() > kMostVariance)
    return restart_covariance();
  Vector6 drift;  // variance
  drift.head<3>().setConstant(dt_s * config.drift_rotation * config.drift_rotation);
  drift.tail<3>().setConstant(dt_s * config.drift_translation * config.drift_translation);
  Matrix6 total = Sigma;
  total.diagonal() += (drift.array() + kLeastVariance).matrix();
  return total;
}

Matrix6 restart_covariance() {
  Vector6 sigma;
  sigma << Eigen::Vector3d::Constant(kRestartRotation),
      Eigen::Vector3d::Constant(kRestartTranslation);
  return sigma.cwiseAbs2().asDiagonal();
}

}  // namespace km
