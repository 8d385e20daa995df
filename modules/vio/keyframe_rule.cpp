#include "modules/vio/keyframe_rule.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "modules/core/data/covariance.hpp"
#include "modules/core/data/measurement_limits.hpp"

namespace km {
namespace {

constexpr double kKeyframeRotation_rad = 0.1;  // rotation after which a keyframe is published

// Standard deviations [rad], [m] of the relative pose across a new start, if only the estimate
// before the start is known.
constexpr double kRestartRotation = 0.3;
constexpr double kRestartTranslation = 1.0;

// Growth of both over time without measurements. Over 2 s, 5 s and 10 s of five flights and walks
// of EuRoC and TUM-VI, heading errs by 0.3-1.4, 0.5-1.7 and 0.8-1.8 rad. Translation errs by
// 0.3-0.9, 0.9-2.0 and 1.2-4.1 m.
constexpr double kUnseenHeading = 0.5;  // [rad/sqrt(s)]
// Standard deviation of a uniformly distributed heading [rad].
constexpr double kMostHeading = std::numbers::pi / std::numbers::sqrt3;
constexpr double kUnseenShare = 0.5;  // share of the distance travelled at the speed
constexpr double kLeastSpeed_mps = 0.5;
constexpr double kMostTranslation_m = 1000.0;

constexpr double kCoast_s = 1.0;  // time for which a speed persists

// Bounds on the variance of a relative pose between keyframes, each axis, in [rad^2] and [m^2]. No
// sensor is more accurate than a microradian and a micrometre. A variance above the upper bound
// shows that there is no estimate.
constexpr double kLeastVariance = 1e-12;
constexpr double kMostVariance = 1e6;

// Covariance of a relative pose [rad], [m] of which gravity determines roll and pitch, if the
// vertical is known.
Matrix6 upright_covariance(double heading, double translation,
                           const std::optional<Eigen::Vector3d>& up_body) {
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();  // axes about which the heading turns
  if (up_body) turned = *up_body * up_body->transpose();
  Matrix6 Sigma = Matrix6::Zero();
  Sigma.topLeftCorner<3, 3>() = kRestartRotation * kRestartRotation * Eigen::Matrix3d::Identity() +
                                heading * heading * turned;
  Sigma.bottomRightCorner<3, 3>().diagonal().setConstant(translation * translation);
  return Sigma;
}

}  // namespace

bool is_keyframe_due(const VioConfig& config, double dt_s, const SE3& T_previous_kf) {
  if (dt_s < config.output_interval_s - 1e-3) return false;
  return dt_s >= config.output_rest_interval_s ||
         T_previous_kf.translation().norm() >= config.output_distance_m ||
         angle_of(T_previous_kf.linear()) >= kKeyframeRotation_rad;
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

double coasting_s(double lasts_s) {
  return -kCoast_s * std::expm1(-0.5 * lasts_s / kCoast_s);
}

Matrix6 restart_covariance(const UnmeasuredMotion& motion) {
  const double heading = std::min(kUnseenHeading * std::sqrt(motion.lasts_s), kMostHeading);
  const double translation = std::min(
      std::hypot(kRestartTranslation,
                 kUnseenShare * std::max(motion.speed_mps, kLeastSpeed_mps) * motion.lasts_s),
      kMostTranslation_m);
  return upright_covariance(heading, translation, motion.up_body);
}

SE3 chain_of_next_run(const KeyframeOdometry& last) {
  constexpr double kApart_m = 1000.0;  // a float still resolves a tenth of a millimetre there
  if (last.id.index == 0) return SE3::Identity();  // a keyframe alone has no surfaces
  return SE3(
      Eigen::Translation3d(last.T_odom_kf.translation() + kApart_m * Eigen::Vector3d::UnitX()));
}

Matrix6 unknown_step_covariance(const std::optional<Eigen::Vector3d>& up_body) {
  return upright_covariance(kUnknownTurn_rad, kUnknownStep_m, up_body);
}

}  // namespace km
