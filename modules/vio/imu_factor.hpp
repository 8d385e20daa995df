#pragma once

#include <optional>

#include "modules/core/odometry.hpp"
#include "modules/vio/preintegration.hpp"

namespace km {

using Vector15 = Eigen::Matrix<double, 15, 1>;
using Matrix15 = Eigen::Matrix<double, 15, 15>;

/// The linearised inertial error between states i and j, whitened. Rows: rotation, velocity,
/// position, gyro bias, accelerometer bias. Columns of each state: rotation, translation (see
/// retract()), velocity, gyro bias, accelerometer bias.
struct ImuTerm {
  Vector15 r;
  Matrix15 J_i;
  Matrix15 J_j;
};

/// What of a state a prior holds, at the values it was first linearised at.
struct FirstEstimate {
  std::optional<SE3> pose;
  std::optional<OdometryState> motion;  ///< Its velocity and biases.

  /// `state` with these parts replaced.
  [[nodiscard]] OdometryState applied_to(const OdometryState& state) const;
};

/// Preintegrated inertial factor between two states (Forster et al., TRO 2017, Sec. VI-D: residuals
/// Eq. (45), their derivatives Eq. (71) to (81)) together with the random walk of both biases
/// (Sec. VI-E, Eq. (47) and (48)).
class ImuFactor {
 public:
  /// Throws std::invalid_argument if `imu` is empty or has no noise: it cannot be whitened.
  ImuFactor(const ImuPreintegration& imu, double gravity_mps2);

  [[nodiscard]] const ImuPreintegration& imu() const { return imu_; }

  /// Whitened error.
  [[nodiscard]] Vector15 error(const OdometryState& i, const OdometryState& j) const;

  /// error(i, j) with derivatives taken at `lin_i`, `lin_j` (first-estimate Jacobians; pass the
  /// states themselves otherwise).
  [[nodiscard]] ImuTerm linearize(const OdometryState& i, const OdometryState& j,
                                  const OdometryState& lin_i, const OdometryState& lin_j) const;

 private:
  ImuPreintegration imu_;
  Eigen::Vector3d gravity_odom_;
  Matrix9 sqrt_information_;
  double gyro_walk_weight_ = 0.0;
  double accel_walk_weight_ = 0.0;
};

}  // namespace km
