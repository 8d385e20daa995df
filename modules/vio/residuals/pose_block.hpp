#pragma once

#include <ceres/manifold.h>

#include <array>

#include "modules/core/odometry.hpp"
#include "modules/vio/residuals/retraction.hpp"

namespace km {

/// Parameter blocks of Ceres. Pose: quaternion x, y, z, w, then translation. Motion: velocity
/// [m/s], gyro bias [rad/s], accelerometer bias [m/s^2].
using PoseBlock = std::array<double, 7>;
using MotionBlock = std::array<double, 9>;

[[nodiscard]] PoseBlock pose_block(const SE3& T_odom_body);
[[nodiscard]] MotionBlock motion_block(const OdometryState& state);
[[nodiscard]] SE3 pose_of(const double* pose_block);

/// The state of two blocks, without a stamp.
[[nodiscard]] OdometryState state_of(const double* pose_block, const double* motion_block);

/// retract() on a pose block. The cost functions deliver their derivatives by the six tangent
/// coordinates in the first six of the seven columns; PlusJacobian passes these on.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

}  // namespace km
