#include "modules/vio/local_warp.hpp"

#include <Eigen/LU>

namespace km {

Eigen::Matrix2f local_warp(const PinholeCamera& a, const PinholeCamera& b,
                           const Eigen::Vector2d& bearing_a, double inverse_depth,
                           const SE3& T_b_a) {
  const auto in_b = [&](const Eigen::Vector2d& bearing) {
    return Eigen::Vector3d(T_b_a.linear() * bearing.homogeneous() +
                           inverse_depth * T_b_a.translation());
  };
  if (in_b(bearing_a).z() < 1e-3) return Eigen::Matrix2f::Identity();
  constexpr double kStep = 2e-3;  // About a pixel.
  Eigen::Matrix2d J_a;
  Eigen::Matrix2d J_b;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(axis);
    const Eigen::Vector2d plus = bearing_a + step;
    const Eigen::Vector2d minus = bearing_a - step;
    J_a.col(axis) = a.project(plus) - a.project(minus);
    J_b.col(axis) = b.project(in_b(plus).hnormalized()) - b.project(in_b(minus).hnormalized());
  }
  return (J_b * J_a.inverse()).cast<float>();
}

}  // namespace km
