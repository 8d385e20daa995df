#pragma once

#include <Eigen/Core>

#include "modules/core/geometry.hpp"

namespace km {

/// Motion of a body at one instant.
struct BodyMotion {
  SE3 T_world_body = SE3::Identity();
  Eigen::Vector3d velocity_world = Eigen::Vector3d::Zero();         ///< [m/s]
  Eigen::Vector3d acceleration_world = Eigen::Vector3d::Zero();     ///< Without gravity [m/s^2].
  Eigen::Vector3d angular_velocity_body = Eigen::Vector3d::Zero();  ///< [rad/s]
};

/// A rigid motion, twice differentiable in time. Immutable, safe to use from several threads.
class BodyTrajectory {
 public:
  virtual ~BodyTrajectory() = default;
  [[nodiscard]] virtual double start_s() const = 0;
  [[nodiscard]] virtual double end_s() const = 0;

  /// Exact derivatives of one curve. `t_s` within [start_s, end_s], else std::out_of_range.
  [[nodiscard]] virtual BodyMotion motion(double t_s) const = 0;
};

}  // namespace km
