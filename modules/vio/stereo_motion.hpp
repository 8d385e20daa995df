#pragma once

#include <Eigen/Core>
#include <optional>
#include <random>
#include <span>

#include "modules/core/geometry.hpp"

namespace km {

/// A landmark with its depth in the previous image and its bearing in the current one.
struct DepthPair {
  Eigen::Vector2d previous = Eigen::Vector2d::Zero();  ///< Bearing, z = 1.
  double inverse_depth = 0.0;                          ///< 1/z in the previous camera [1/m], >= 0.
  Eigen::Vector2d current = Eigen::Vector2d::Zero();   ///< Bearing, z = 1.
};

/// `pair`'s landmark in the current camera divided by its depth in the previous one: a direction,
/// with the landmark's relative depth in z. Not positive z: behind the camera.
[[nodiscard]] Eigen::Vector3d transfer(const DepthPair& pair, const SE3& T_previous_current);

/// Distance on z = 1 between pair.current and where the motion puts the landmark; infinite if that
/// is behind the camera.
[[nodiscard]] double reprojection_distance(const DepthPair& pair, const SE3& T_previous_current);

/// The motion of the camera that most landmarks agree on, or nullopt if there are fewer than
/// kMinMotionPairs or fewer than half of them agree.
///
/// Samples of two landmarks give translations under the rotation of `guess` (linear, 4 equations
/// for 3 unknowns); the translation of `guess` is tried too. The best is then refined over all six
/// degrees of freedom with a Geman-McClure weight whose scale shrinks to `sigma`, because the
/// gyroscope's bias alone can turn the guess by pixels. Compared with voting on 3D displacements
/// (1-point stereo of Kimera-VIO) the test is in pixels, where the noise is known, so that it is
/// as sharp for far landmarks as for near ones, and the right image is not needed yet: the motion
/// can predict where to look there.
/// `sigma`: noise of a bearing on z = 1. Deterministic for equal inputs and state of `rng`.
[[nodiscard]] std::optional<SE3> estimate_motion(std::span<const DepthPair> pairs,
                                                 const SE3& guess_T_previous_current, double sigma,
                                                 std::mt19937& rng);

inline constexpr std::size_t kMinMotionPairs = 8;

}  // namespace km
