#pragma once

#include <Eigen/Core>
#include <random>
#include <span>
#include <vector>

namespace km {

/// A point seen in two images of one camera; bearings on z = 1.
struct BearingPair {
  Eigen::Vector2d previous = Eigen::Vector2d::Zero();
  Eigen::Vector2d current = Eigen::Vector2d::Zero();
};

/// Which pairs agree with one direction of translation.
struct TwoPointResult {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< Of t_previous_current, unit, any sign.
  std::vector<bool> inlier;                             ///< One for each pair.
  int inliers = 0;
};

/// Distance of pair.current from the epipolar line of pair.previous, on z = 1 of the current
/// camera, for p_previous = R * p_current + t. Zero if t gives no line (t along the ray, or t = 0).
[[nodiscard]] double epipolar_distance(const BearingPair& pair, const Eigen::Matrix3d& R,
                                       const Eigen::Vector3d& t);

/// Rejects mono outliers with the rotation known from a gyroscope: two pairs then fix the direction
/// of translation, t ~ (b1 x R b1') x (b2 x R b2') (Troiani et al., "2-Point-based outlier
/// rejection for camera-IMU systems", ICRA 2014). Consensus over `kTwoPointSamples` samples of
/// `rng`; `threshold` is an epipolar_distance(). Fewer than 3 pairs are all inliers: nothing can
/// contradict them. In a pure rotation every direction explains every true pair, which is right.
[[nodiscard]] TwoPointResult two_point_ransac(std::span<const BearingPair> pairs,
                                              const Eigen::Matrix3d& R_previous_current,
                                              double threshold, std::mt19937& rng);

inline constexpr int kTwoPointSamples = 64;

}  // namespace km
