#pragma once

#include <cstdint>
#include <random>

#include "modules/core/geometry/lie.hpp"
#include "modules/loop_closure/relative_pose.hpp"
#include "test/support/random_pose.hpp"

namespace km {

inline constexpr double kFocal_px = 458.0;
inline constexpr double kBaseline_m = 0.11;

/// A point as camera `T_world_cam` measures it, with noise of `sigmas` times `noise`.
inline Keypoint measured(const SE3& T_world_cam, const Eigen::Vector3d& p_world,
                         const ImageNoise& noise, double sigmas, std::mt19937& rng) {
  const Eigen::Vector3d p_cam = T_world_cam.inverse() * p_world;
  const Eigen::Vector3d n = sigmas * random_vector<3>(rng);
  const Eigen::Vector2d bearing = p_cam.hnormalized() + noise.keypoint_px / kFocal_px * n.head<2>();
  const double inverse_depth =
      1.0 / p_cam.z() + noise.disparity_px / (kFocal_px * kBaseline_m) * n.z();
  return {.bearing = bearing.cast<float>(),
          .inverse_depth = static_cast<float>(std::max(inverse_depth, 1e-4)),
          .octave = 0};
}

/// Two keyframes that see the same `count` random points 2 to 6 m ahead, descriptor i of one being
/// descriptor i of the other. The cameras sit on bodies at T_body_cam, `motion` [rad, m] apart.
struct KeyframePair {
  SE3 T_from_to = SE3::Identity();  ///< Relative pose of the bodies.
  KeyframeFeatures from, to;
};

template <typename Descriptor = BinaryDescriptor>
Descriptor random_descriptor(std::mt19937& rng) {
  Descriptor descriptor;
  for (std::uint8_t& byte : descriptor) byte = static_cast<std::uint8_t>(rng());
  return descriptor;
}

inline KeyframePair make_keyframe_pair(std::mt19937& rng, int count, const ImageNoise& noise,
                                       double sigmas, double motion = 0.15) {
  const SE3 T_body_cam = random_pose(rng, 0.2);
  Vector6 xi = motion * random_vector<6>(rng);
  const SE3 T_cam_cam = se3_exp(xi);  // from's camera is the world
  KeyframePair pair;
  pair.T_from_to = T_body_cam * T_cam_cam * T_body_cam.inverse();
  pair.from.T_body_cam = pair.to.T_body_cam = T_body_cam;
  pair.from.focal_px = pair.to.focal_px = kFocal_px;
  pair.from.baseline_m = pair.to.baseline_m = kBaseline_m;
  std::uniform_real_distribution<double> bearing(-0.6, 0.6);
  std::uniform_real_distribution<double> depth(2.0, 6.0);
  for (int i = 0; i < count; ++i) {
    Eigen::Vector3d p(0.0, 0.0, 1.0);
    p.x() = bearing(rng);
    p.y() = bearing(rng);
    p *= depth(rng);
    pair.from.keypoints.push_back(measured(SE3::Identity(), p, noise, sigmas, rng));
    pair.to.keypoints.push_back(measured(T_cam_cam, p, noise, sigmas, rng));
    pair.from.descriptors.push_back(random_descriptor(rng));
    pair.to.descriptors.push_back(pair.from.descriptors.back());
  }
  return pair;
}

}  // namespace km
