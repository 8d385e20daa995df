#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"

namespace km {

/// Smooth noise in [0, 1] with value 0.5 on average: a random number at each corner of a grid of
/// unit cells, blended by a cubic. It keeps the corners of the last cell, because neighbouring
/// pixels are mostly in one cell.
class SmoothNoise {
 public:
  explicit SmoothNoise(std::uint32_t seed) : seed_(seed) {}

  [[nodiscard]] double at(double x, double y) {
    const double x0 = std::floor(x);
    const double y0 = std::floor(y);
    if (x0 != x0_ || y0 != y0_) enter(x0, y0);
    const auto blend = [](double t) { return t * t * (3.0 - 2.0 * t); };
    const double u = blend(x - x0);
    const double v = blend(y - y0);
    return (1 - v) * ((1 - u) * corners_[0] + u * corners_[1]) +
           v * ((1 - u) * corners_[2] + u * corners_[3]);
  }

 private:
  [[nodiscard]] double corner(double x, double y) const {
    std::uint32_t h = static_cast<std::uint32_t>(static_cast<std::int64_t>(x)) * 0x9E3779B1U ^
                      static_cast<std::uint32_t>(static_cast<std::int64_t>(y)) * 0x85EBCA77U ^
                      seed_ * 0xC2B2AE3DU;
    h = (h ^ (h >> 15)) * 0x2C1B3C6DU;
    h = (h ^ (h >> 12)) * 0x297A2D39U;
    return static_cast<double>((h ^ (h >> 15)) & 0xFFFFU) / 65535.0;
  }
  void enter(double x0, double y0) {
    x0_ = x0, y0_ = y0;
    corners_ = {corner(x0, y0), corner(x0 + 1, y0), corner(x0, y0 + 1), corner(x0 + 1, y0 + 1)};
  }

  std::uint32_t seed_;
  double x0_ = std::numeric_limits<double>::quiet_NaN(), y0_ = x0_;  // lower corner of the cell
  std::array<double, 4> corners_{};
};

inline double smooth_noise(double x, double y, std::uint32_t seed) {
  return SmoothNoise(seed).at(x, y);
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
    SmoothNoise fine(seed), coarse(seed + 1);
    for (const auto& bearing : bearings_of(camera))
      image.pixels.push_back(bearing ? level(meet(T_world_cam, *bearing) / cell_m, fine, coarse)
                                     : std::uint8_t{0});
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
  // `p` is in cells.
  [[nodiscard]] static std::uint8_t level(const Eigen::Vector3d& p, SmoothNoise& fine,
                                          SmoothNoise& coarse) {
    const double value = 0.7 * fine.at(p.x(), p.y()) + 0.3 * coarse.at(0.37 * p.x(), 0.37 * p.y());
    return static_cast<std::uint8_t>(255.0 * std::clamp(value, 0.0, 1.0) + 0.5);
  }
};

/// An image of one grey level.
inline GrayImage flat_image(const Camera& camera, std::uint8_t level) {
  const auto pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  return {camera.width, camera.height, std::vector<std::uint8_t>(pixels, level)};
}

}  // namespace km
