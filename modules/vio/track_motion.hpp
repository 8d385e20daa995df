#pragma once

#include <Eigen/Core>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "modules/core/geometry/geometry.hpp"

namespace km {

/// A landmark with its depth in the previous image and its bearing in the current one.
struct DepthPair {
  Eigen::Vector2d previous = Eigen::Vector2d::Zero();  ///< Bearing, z = 1.
  double inverse_depth = 0.0;                          ///< 1/z in the previous camera [1/m], >= 0.
  Eigen::Vector2d current = Eigen::Vector2d::Zero();   ///< Bearing, z = 1.
};

/// Position of `pair`'s landmark in the current camera, divided by its depth in the previous one: a
/// direction, with the landmark's relative depth in z. If z is not positive, the landmark is behind
/// the camera.
[[nodiscard]] Eigen::Vector3d transfer(const DepthPair& pair, const SE3& T_previous_current);

/// Distance on z = 1 between pair.current and the landmark transferred by the motion; infinite if
/// the landmark is behind the camera.
[[nodiscard]] double reprojection_distance(const DepthPair& pair, const SE3& T_previous_current);

/// The motion of the camera that most landmarks agree on, or nullopt if there are fewer than
/// kMinMotionPairs or fewer than half of them agree.
///
/// Samples of two landmarks give translations under the rotation of `guess` (linear, 4 equations
/// for 3 unknowns). The translation of `guess` is tried too. The best is then refined over all six
/// degrees of freedom with a Geman-McClure weight whose scale shrinks to `sigma`. The refinement
/// includes the rotation because the gyroscope's bias alone can rotate the guess by pixels.
///
/// In contrast to voting on 3D displacements (1-point stereo of Kimera-VIO) the test is in pixels,
/// where the noise is known. The test is therefore as sharp for far landmarks as for near ones. The
/// test does not need the right image, so the motion can predict where to search in that image.
/// `sigma`: noise of a bearing on z = 1. Deterministic for equal inputs and state of `rng`.
[[nodiscard]] std::optional<SE3> estimate_motion(std::span<const DepthPair> pairs,
                                                 const SE3& guess_T_previous_current, double sigma,
                                                 std::mt19937& rng);

/// estimate_motion() without a gyroscope: samples of three landmarks give rotation and translation,
/// by Gauss-Newton steps from `guess` (6 equations for 6 unknowns). The guess may be wrong by some
/// ten degrees.
[[nodiscard]] std::optional<SE3> estimate_free_motion(std::span<const DepthPair> pairs,
                                                      const SE3& guess_T_previous_current,
                                                      double sigma, std::mt19937& rng);

inline constexpr std::size_t kMinMotionPairs = 8;

/// A point seen in two images of one camera; bearings on z = 1.
struct BearingPair {
  Eigen::Vector2d previous = Eigen::Vector2d::Zero();
  Eigen::Vector2d current = Eigen::Vector2d::Zero();
};

/// The direction of translation that most pairs agree with, and these pairs.
struct TwoPointResult {
  /// Direction of t_previous_current, unit length, any sign.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  std::vector<bool> inlier;  ///< One for each pair.
  int inliers = 0;
};

/// Distance of pair.current from the epipolar line of pair.previous, on z = 1 of the current
/// camera, for p_previous = R * p_current + t. Zero if t gives no line (t along the ray, or t = 0).
[[nodiscard]] double epipolar_distance(const BearingPair& pair, const Eigen::Matrix3d& R,
                                       const Eigen::Vector3d& t);

/// Rejects mono outliers with the rotation known from a gyroscope. Two pairs then determine the
/// direction of translation, t ~ (b1 x R b1') x (b2 x R b2') (Troiani et al., "2-Point-based
/// outlier rejection for camera-IMU systems", ICRA 2014). Consensus over `kTwoPointSamples` samples
/// of `rng`; `threshold` is an epipolar_distance(). Fewer than 3 pairs are all inliers, because
/// nothing can contradict them. In a pure rotation every direction fits every correct pair, so all
/// of them are inliers.
[[nodiscard]] TwoPointResult two_point_ransac(std::span<const BearingPair> pairs,
                                              const Eigen::Matrix3d& R_previous_current,
                                              double threshold, std::mt19937& rng);

inline constexpr int kTwoPointSamples = 64;

}  // namespace km
