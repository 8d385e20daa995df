#include "modules/diagnosis/stereo_fit.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "modules/core/geometry/lie.hpp"
#include "modules/core/quantile.hpp"

namespace km {
namespace {

constexpr double kMinParallax_px = 1.5;  // least parallax whose sign is certain
constexpr double kClearGain = 0.15;      // least gain in the inlier ratio of a better calibration
constexpr double kFair = 0.5;            // least inlier ratio of a calibration that may be right

Camera with_pose_of(Camera camera, const SE3& T_body_cam) {
  camera.T_body_cam = T_body_cam;
  return camera;
}

StereoRig with_focal_ratio(StereoRig rig, double ratio) {
  rig.cameras[1].fx *= ratio;
  rig.cameras[1].fy *= ratio;
  return rig;
}

// K of images of another size: of a mode with another binning.
StereoRig with_scaled_images(StereoRig rig, double ratio) {
  for (Camera& camera : rig.cameras) {
    camera.fx *= ratio, camera.fy *= ratio;
    camera.cx = ratio * (camera.cx + 0.5) - 0.5;
    camera.cy = ratio * (camera.cy + 0.5) - 0.5;
  }
  return rig;
}

std::vector<StereoMatches> swapped(std::span<const StereoMatches> images) {
  std::vector<StereoMatches> result(images.begin(), images.end());
  for (StereoMatches& matches : result)
    for (PixelPair& pair : matches.pairs) std::swap(pair.a, pair.b);
  return result;
}

// The best ratio of focal lengths between 0.8 and 1.2.
StereoAlternative best_focal_ratio(std::span<const StereoMatches> images, const StereoRig& rig) {
  constexpr int kSteps = 40;
  constexpr double kStep = 0.005;
  StereoAlternative best{.fault = StereoFault::kFocalLength, .focal_ratio = 1.0, .fit = {}};
  for (int k = -kSteps; k <= kSteps; ++k) {
    const double ratio = 1.0 + kStep * k;
    const StereoFit fit = fit_of(images, with_focal_ratio(rig, ratio));
    if (fit.inlier_ratio > best.fit.inlier_ratio) best = {StereoFault::kFocalLength, ratio, fit};
  }
  return best;
}

// The best inlier ratio with the right camera turned about its x axis by up to 0.02 rad. The turn
// moves all points equally. A ratio r of the focal lengths moves a point at the height v above the
// centre by (r - 1) v. Only points at several heights distinguish the two.
double best_turned_ratio(std::span<const StereoMatches> images, const StereoRig& rig) {
  constexpr int kSteps = 40;
  constexpr double kStep_rad = 0.0005;
  double best = 0.0;
  for (int k = -kSteps; k <= kSteps; ++k) {
    StereoRig turned = rig;
    turned.cameras[1].T_body_cam.rotate(Eigen::AngleAxisd(kStep_rad * k, Eigen::Vector3d::UnitX()));
    best = std::max(best, fit_of(images, turned).inlier_ratio);
  }
  return best;
}

}  // namespace

std::optional<StereoPoint> stereo_point(const StereoRig& rig, const SE3& T_right_left,
                                        const PixelPair& pair) {
  const auto left = rig.cameras[0].unproject(pair.a);
  const auto right = rig.cameras[1].unproject(pair.b);
  if (!left || !right) return std::nullopt;
  const Eigen::Vector3d& t = T_right_left.translation();
  const Eigen::Vector3d turned = T_right_left.linear() * left->homogeneous();
  const Eigen::Vector3d seen = right->homogeneous();
  if (!(turned.z() > 0.0)) return std::nullopt;
  const Eigen::Vector3d line = skew(t) * turned;  // epipolar line of the right image, on z = 1
  const double length = line.head<2>().norm();
  if (!(length >= 1e-12)) return std::nullopt;
  const double focal_px = rig.cameras[1].fx;
  // Minimises the squared distance of z_right * seen = z_left * turned + t.
  Eigen::Matrix<double, 3, 2> A;
  A << turned, -seen;
  return StereoPoint{.left = *left,
                     .error_px = focal_px * std::abs(line.dot(seen)) / length,
                     .parallax_px = focal_px * (seen.head<2>() - turned.hnormalized()).norm(),
                     .depth_m = A.colPivHouseholderQr().solve(-t).x()};
}

StereoFit fit_of(std::span<const StereoMatches> images, const StereoRig& rig, double inlier_px) {
  const SE3 T_right_left = rig.T_left_right().inverse();
  StereoFit fit;
  std::vector<double> errors_px, depths_m;
  std::size_t inliers = 0;
  for (const StereoMatches& image : images)
    for (const PixelPair& pair : image.pairs) {
      ++fit.points;
      const auto point = stereo_point(rig, T_right_left, pair);
      errors_px.push_back(point ? point->error_px : std::numeric_limits<double>::infinity());
      if (!point || !(point->error_px <= inlier_px)) continue;
      if (point->depth_m < 0.0 && point->parallax_px > kMinParallax_px) continue;  // behind it
      ++inliers;
      if (point->depth_m > 0.0) depths_m.push_back(point->depth_m);
    }
  fit.inlier_ratio =
      static_cast<double>(inliers) / static_cast<double>(std::max<std::size_t>(fit.points, 1));
  fit.error_px = quantile(std::move(errors_px), 0.5);
  fit.depth_m = quantile(std::move(depths_m), 0.5);
  return fit;
}

StereoRig undone(const StereoRig& rig, StereoFault fault) {
  StereoRig result = rig;
  Camera &left = result.cameras[0], &right = result.cameras[1];
  switch (fault) {
    case StereoFault::kInvertedPair:
      right.T_body_cam = left.T_body_cam * rig.T_left_right().inverse();
      break;
    case StereoFault::kInvertedCameras:
      left.T_body_cam = left.T_body_cam.inverse();
      right.T_body_cam = right.T_body_cam.inverse();
      break;
    case StereoFault::kInvertedLeft:
      left.T_body_cam = left.T_body_cam.inverse();
      break;
    case StereoFault::kInvertedRight:
      right.T_body_cam = right.T_body_cam.inverse();
      break;
    case StereoFault::kExchangedLenses:
      left = with_pose_of(rig.cameras[1], rig.cameras[0].T_body_cam);
      right = with_pose_of(rig.cameras[0], rig.cameras[1].T_body_cam);
      break;
    case StereoFault::kNone:
    case StereoFault::kSwappedImages:
    case StereoFault::kFocalLength:
    case StereoFault::kOtherMode:
      break;
  }
  return result;
}

StereoAlternative best_alternative(std::span<const StereoMatches> images, const StereoRig& rig) {
  const StereoAlternative given{.fit = fit_of(images, rig)};
  StereoAlternative best = given;
  const auto consider = [&best](const StereoAlternative& alternative) {
    if (alternative.fit.inlier_ratio > best.fit.inlier_ratio) best = alternative;
  };
  consider({.fault = StereoFault::kSwappedImages, .fit = fit_of(swapped(images), rig)});
  for (const StereoFault fault :
       {StereoFault::kInvertedPair, StereoFault::kInvertedCameras, StereoFault::kInvertedLeft,
        StereoFault::kInvertedRight, StereoFault::kExchangedLenses})
    consider({.fault = fault, .fit = fit_of(images, undone(rig, fault))});
  // Errors are compared as angles, because a focal length scales them. Too long a focal length
  // shows errors so large that the pair is not sound.
  for (const double ratio : {0.5, 2.0})
    if (ratio > 1.0 || !is_sound(given.fit))
      consider({StereoFault::kOtherMode, ratio,
                fit_of(images, with_scaled_images(rig, ratio), ratio * kEpipolarInlier_px)});
  // Only without such a fault, because another focal length compensates some errors of a fault.
  if (best.fit.inlier_ratio < given.fit.inlier_ratio + kClearGain) {
    const StereoAlternative focal = best_focal_ratio(images, rig);
    if (focal.fit.inlier_ratio > given.fit.inlier_ratio + kClearGain &&
        focal.fit.inlier_ratio > best_turned_ratio(images, rig) + kClearGain)
      consider(focal);
  }
  const bool is_clear =
      best.fit.inlier_ratio > given.fit.inlier_ratio + kClearGain && best.fit.inlier_ratio > kFair;
  return is_clear ? best : given;
}

}  // namespace km
