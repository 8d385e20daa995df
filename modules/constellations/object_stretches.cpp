#include "modules/constellations/object_stretches.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace km {
namespace {

constexpr KeyframeIndex kVisit = 100;  // keyframes of one visit
constexpr double kMaxSigma_m = 1.0;    // largest useful error of a centre
// Standard deviation of the centre of a box along each axis for an object that is seen from all
// sides: about half a voxel.
constexpr double kCenterNoise_m = 0.1;

// Standard deviation of the shift of the centre of a box, as a share of its sides. A robot that
// sees one side of an object shifts it by up to half of the other.
constexpr double kUnseenShare = 0.1;
constexpr double kMinMove_m = 0.05;  // as for the messages of ObjectsNode

KeyframeIndex gap(KeyframeIndex a, KeyframeIndex b) {
  return a < b ? b - a : a - b;
}

Landmark landmark_of(const AnchoredObject& object, const Eigen::Vector3d& center) {
  const Eigen::Vector3d& size = object.size_m;
  const double longer = std::max(size.x(), size.y());
  return {.label = object.label,
          .center = center,
          .size_m = {longer, std::min(size.x(), size.y()), size.z()},
          .sigma_m = std::hypot(kCenterNoise_m, kStretchDrift * center.norm()),
          .side_shift_m = kUnseenShare * longer,
          .height_shift_m = kUnseenShare * size.z()};
}

std::vector<Landmark> landmarks_near(const SurfaceKeyframe& keyframe, const RobotObjects& objects) {
  std::vector<Landmark> near;
  for (const AnchoredObject& object : objects.objects) {
    if (gap(object.keyframe, keyframe.odometry.id.index) > kVisit) continue;
    const Eigen::Vector3d center =
        (object.T_world_kf * object.T_kf_box).translation() - keyframe.T_world_kf.translation();
    if (center.norm() > kStretchRadius_m) continue;
    const Landmark landmark = landmark_of(object, center);
    if (landmark.side_variance() + landmark.height_variance() <= 2.0 * kMaxSigma_m * kMaxSigma_m)
      near.push_back(landmark);
  }
  std::ranges::stable_sort(near, {}, [](const Landmark& x) { return x.center.norm(); });
  if (near.size() > kMaxLandmarks) near.resize(kMaxLandmarks);
  return near;
}

bool differ(const Landmark& a, const Landmark& b) {
  return a.label != b.label || (a.center - b.center).cwiseAbs().maxCoeff() > kMinMove_m ||
         (a.size_m - b.size_m).cwiseAbs().maxCoeff() > kMinMove_m;
}

}  // namespace

std::vector<ObjectStretch> stretches_of(const RobotObjects& objects, std::size_t min_landmarks) {
  std::vector<ObjectStretch> stretches;
  for (const SurfaceKeyframe& keyframe : objects.keyframes) {
    const bool is_known = std::ranges::any_of(stretches, [&](const ObjectStretch& other) {
      const Eigen::Vector3d apart =
          other.keyframe.T_world_kf.translation() - keyframe.T_world_kf.translation();
      return apart.norm() < 0.5 * kStretchRadius_m &&
             gap(other.keyframe.odometry.id.index, keyframe.odometry.id.index) <= kVisit;
    });
    if (is_known) continue;
    std::vector<Landmark> landmarks = landmarks_near(keyframe, objects);
    if (landmarks.size() < min_landmarks) continue;
    stretches.push_back({keyframe, {}, std::move(landmarks)});
    std::ranges::copy_if(objects.keyframes, std::back_inserter(stretches.back().keyframes),
                         [&](const SurfaceKeyframe& other) {
                           return gap(other.odometry.id.index, keyframe.odometry.id.index) <=
                                  kVisit;
                         });
  }
  return stretches;
}

bool differ(const ObjectStretch& a, const ObjectStretch& b) {
  return a.keyframe.odometry.id != b.keyframe.odometry.id ||
         !std::ranges::equal(a.landmarks, b.landmarks,
                             [](const Landmark& x, const Landmark& y) { return !differ(x, y); });
}

}  // namespace km
