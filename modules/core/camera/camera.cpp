#include "modules/core/camera/camera.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>
#include <string>

namespace km {

std::optional<Eigen::Vector2d> Camera::project(const Eigen::Vector2d& bearing) const {
  const std::optional<Eigen::Vector2d> point = lens.distorted(bearing);
  if (!point) return std::nullopt;
  return Eigen::Vector2d(fx * point->x() + cx, fy * point->y() + cy);
}

std::optional<Eigen::Vector2d> Camera::project_ray(const Eigen::Vector3d& ray) const {
  if (!(ray.z() > 0.0)) return std::nullopt;
  return project(ray.hnormalized());
}

std::optional<Eigen::Vector2d> Camera::unproject(const Eigen::Vector2d& pixel) const {
  return lens.undistorted({(pixel.x() - cx) / fx, (pixel.y() - cy) / fy});
}

StereoRig rgbd_rig(const Camera& camera, double baseline_m) {
  if (!(baseline_m > 0.0) || !std::isfinite(baseline_m))
    throw std::invalid_argument("rgbd_rig: a virtual baseline of " + std::to_string(baseline_m) +
                                " m");
  StereoRig rig{{camera, camera}, DepthSource::kDepthImage};
  rig.cameras[1].T_body_cam =
      camera.T_body_cam * Eigen::Translation3d(baseline_m * Eigen::Vector3d::UnitX());
  return rig;
}

}  // namespace km
