#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"

namespace km {

/// Smooth noise in [0, 1] with value 0.5 on average: a random number at each corner of a grid of
/// unit cells, blended by a cubic.
inline double smooth_noise(double x, double y, std::uint32_t seed) {
  const auto corner = [seed](double cx, double cy) {
    std::uint32_t h = static_cast<std::uint32_t>(static_cast<std::int64_t>(cx)) * 0x9E3779B1U ^
                      static_cast<std::uint32_t>(static_cast<std::int64_t>(cy)) * 0x85EBCA77U ^
                      seed * 0xC2B2AE3DU;
    h = (h ^ (h >> 15)) * 0x2C1B3C6DU;
    h = (h ^ (h >> 12)) * 0x297A2D39U;
    return static_cast<double>((h ^ (h >> 15)) & 0xFFFFU) / 65535.0;
  };
  const double x0 = std::floor(x);
  const double y0 = std::floor(y);
  const auto blend = [](double t) { return t * t * (3.0 - 2.0 * t); };
  const double u = blend(x - x0);
  const double v = blend(y - y0);
  return (1 - v) * ((1 - u) * corner(x0, y0) + u * corner(x0 + 1, y0)) +
         v * ((1 - u) * corner(x0, y0 + 1) + u * corner(x0 + 1, y0 + 1));
}

/// Two equal cameras side by side, x right, with the distortion of a wide lens.
inline StereoRig test_rig(double baseline_m = 0.11) {
  Camera camera{.width = 376, .height = 240, .fx = 230.0, .fy = 230.0, .cx = 185.0, .cy = 121.0};
  camera.lens = Lens(LensModel::kRadialTangential, {-0.28, 0.07, 2e-4, 1e-5});
  StereoRig rig;
  rig.cameras = {camera, camera};
  rig.cameras[1].T_body_cam.translation().x() = baseline_m;
  return rig;
}

/// The same cameras with the lens of TUM-VI's: 143 degrees across, and corners without bearings.
inline StereoRig fisheye_rig() {
  StereoRig rig = test_rig();
  for (Camera& camera : rig.cameras) {
    camera.fx = camera.fy = 150.0;
    camera.lens = Lens(LensModel::kEquidistant, {0.0034823894022493434, 0.0007150348452162257,
                                                 -0.0020532361418706202, 0.00020293673591811182});
  }
  return rig;
}

/// Bearings of all pixels, row by row. They are kept for the next image of the same lens, because
/// undistortion takes most of the time of an image.
inline const std::vector<std::optional<Eigen::Vector2d>>& bearings_of(const Camera& camera) {
  static std::vector<std::optional<Eigen::Vector2d>> bearings;
  static Camera last;
  const auto lens = [](const Camera& c) {
    return std::tie(c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.lens);
  };
  if (lens(camera) == lens(last)) return bearings;
  last = camera;
  bearings.clear();
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x)
      bearings.push_back(camera.unproject(Eigen::Vector2d(x, y)));
  return bearings;
}

/// A plane z = depth_m of the world with a random texture. Its cells are `cell_m` wide, at least
/// about 6 px in the image, so that pixels need not be averaged.
struct TexturedPlane {
  double depth_m = 2.0;
  double cell_m = 0.06;
  std::uint32_t seed = 1;

  [[nodiscard]] GrayImage render(const Camera& camera, const SE3& T_world_body) const {
    GrayImage image{camera.width, camera.height, {}};
    const SE3 T_world_cam = T_world_body * camera.T_body_cam;
    for (const auto& bearing : bearings_of(camera))
      image.pixels.push_back(bearing ? level(T_world_cam, *bearing) : std::uint8_t{0});
    return image;
  }

  [[nodiscard]] StereoFrame render(const StereoRig& rig, const SE3& T_world_body,
                                   Stamp stamp) const {
    return {stamp, render(rig.cameras[0], T_world_body), render(rig.cameras[1], T_world_body)};
  }

  /// Image of an RGB-D camera, with `rig` from rgbd_rig().
  [[nodiscard]] StereoFrame render_rgbd(const StereoRig& rig, const SE3& T_world_body,
                                        Stamp stamp) const {
    const Camera& camera = rig.cameras[0];
    const SE3 T_world_cam = T_world_body * camera.T_body_cam;
    DepthImage depth{camera.width, camera.height, {}};
    for (const auto& bearing : bearings_of(camera)) {
      const double z_m = bearing ? (T_world_cam.inverse() * meet(T_world_cam, *bearing)).z() : 0.0;
      depth.millimetres.push_back(static_cast<std::uint16_t>(std::lround(1e3 * z_m)));
    }
    StereoFrame frame{stamp, render(camera, T_world_body), {}};
    frame.depth = std::make_shared<const DepthImage>(std::move(depth));
    return frame;
  }

  /// Intersection of the ray of `bearing` with the plane, in the world.
  [[nodiscard]] Eigen::Vector3d meet(const SE3& T_world_cam, const Eigen::Vector2d& bearing) const {
    const Eigen::Vector3d ray = T_world_cam.linear() * bearing.homogeneous();
    const Eigen::Vector3d& from = T_world_cam.translation();
    return from + ray * ((depth_m - from.z()) / ray.z());
  }

 private:
  [[nodiscard]] std::uint8_t level(const SE3& T_world_cam, const Eigen::Vector2d& bearing) const {
    const Eigen::Vector3d p = meet(T_world_cam, bearing) / cell_m;
    const double value = 0.7 * smooth_noise(p.x(), p.y(), seed) +
                         0.3 * smooth_noise(0.37 * p.x(), 0.37 * p.y(), seed + 1);
    return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(value, 0.0, 1.0)));
  }
};

/// An image of one grey level.
inline GrayImage flat_image(const Camera& camera, std::uint8_t level) {
  const auto pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  return {camera.width, camera.height, std::vector<std::uint8_t>(pixels, level)};
}

}  // namespace km
