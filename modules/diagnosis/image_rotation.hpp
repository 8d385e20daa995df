#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

namespace km {

/// A point in two images of one camera: bearings on z = 1.
struct BearingStep {
  Eigen::Vector2d from = Eigen::Vector2d::Zero();
  Eigen::Vector2d to = Eigen::Vector2d::Zero();
};

/// How a camera turned between two images.
struct ImageRotation {
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();  ///< R_from_to as rotation vector [rad].
  double inlier_share = 0.0;  ///< Of the points, within 3 sigma of their epipolar line.
};

/// The rotation that the epipolar constraint gives, from_i^T [t]x R to_i = 0 for all i, for an
/// unknown direction t; by itself, without inertial data. Gauss-Newton over the five unknowns on
/// the Sampson distance (Hartley and Zisserman, "Multiple View Geometry", 2nd ed., Eq. (11.9)) with
/// Geman-McClure weights whose scale shrinks to `sigma`, the noise of a bearing, from two starts:
/// the rotation that explains the points alone, and none. For small rotations, between images a
/// fraction of a second apart. nullopt for fewer than 20 points, or if less than half are inliers.
[[nodiscard]] std::optional<ImageRotation> rotation_between(std::span<const BearingStep> steps,
                                                            double sigma);

}  // namespace km
