#include "modules/core/camera.hpp"

#include <Eigen/LU>
#include <cmath>
#include <stdexcept>
#include <string>

namespace km {
namespace {

// Distorted bearing and its Jacobian with respect to the undistorted one.
struct Distorted {
  Eigen::Vector2d point;
  Eigen::Matrix2d J;
};

Distorted distort(const std::array<double, 4>& d, const Eigen::Vector2d& p) {
  const auto [k1, k2, p1, p2] = d;
  const double x = p.x();
  const double y = p.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1 + r2 * k2);
  const double slope = 2.0 * (k1 + 2.0 * k2 * r2);  // d(radial)/dx = slope * x
  Distorted result;
  result.point << x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
      y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
  const double cross = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y;
  result.J << radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x, cross,  //
      cross, radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x;
  return result;
}

}  // namespace

Eigen::Vector2d PinholeCamera::project(const Eigen::Vector2d& bearing) const {
  const Eigen::Vector2d point = distort(distortion, bearing).point;
  return {fx * point.x() + cx, fy * point.y() + cy};
}

std::optional<Eigen::Vector2d> PinholeCamera::unproject(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d target((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  Eigen::Vector2d bearing = target;
  constexpr int kMaxSteps = 20;
  for (int i = 0; i < kMaxSteps; ++i) {
    const Distorted at = distort(distortion, bearing);
    const Eigen::Vector2d error = at.point - target;
    if (error.squaredNorm() < 1e-24) return bearing;
    // A fold of the radial polynomial: beyond it the model maps two bearings to one pixel.
    if (at.J.determinant() <= 0.0) return std::nullopt;
    bearing -= at.J.inverse() * error;
    if (!bearing.allFinite()) return std::nullopt;
  }
  return std::nullopt;
}

StereoRig rgbd_rig(const PinholeCamera& camera, double baseline_m) {
  if (!(baseline_m > 0.0) || !std::isfinite(baseline_m))
    throw std::invalid_argument("rgbd_rig: a virtual baseline of " + std::to_string(baseline_m) +
                                " m");
  StereoRig rig{{camera, camera}, DepthSource::kDepthImage};
  rig.cameras[1].T_body_cam =
      camera.T_body_cam * Eigen::Translation3d(baseline_m * Eigen::Vector3d::UnitX());
  return rig;
}

}  // namespace km
