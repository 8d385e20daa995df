#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/diagnosis/inertial_fit.hpp"
#include "modules/diagnosis/sensor_sample.hpp"

namespace km {

/// A point in two images of one camera: bearings on z = 1.
struct BearingStep {
  Eigen::Vector2d from = Eigen::Vector2d::Zero();
  Eigen::Vector2d to = Eigen::Vector2d::Zero();
};

/// Rotation of a camera between two images.
struct ImageRotation {
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();  ///< R_from_to as rotation vector [rad].
  double inlier_ratio = 0.0;  ///< Share of the points within 3 sigma of their epipolar line.
};

/// The rotation from the epipolar constraint, from_i^T [t]x R to_i = 0 for all i, for an unknown
/// direction t, without inertial data. The method is Gauss-Newton over the five unknowns on the
/// Sampson distance (Hartley and Zisserman, "Multiple View Geometry", 2nd ed., Eq. (11.9)) with
/// Geman-McClure weights. Their scale shrinks to `sigma`, the noise of a bearing. There are two
/// starts: the rotation that explains the points without translation, and no rotation. The method
/// is for small rotations, between images a fraction of a second apart. nullopt for fewer than 20
/// points, or if fewer than half of the points are inliers.
[[nodiscard]] std::optional<ImageRotation> rotation_between(std::span<const BearingStep> steps,
                                                            double sigma);

/// Rotations of the left camera. Without depths a rotation and a translation across the image are
/// hard to distinguish. The estimated rotation then depends on the focal length, so it cannot serve
/// to estimate the focal length.
struct VisualRotations {
  std::vector<VisualRotation> steps;
  std::size_t with_depth = 0;  ///< Number of steps with depths.
};

/// For each step, rotation_between(), refined by estimate_motion() of the tracker if `use_depth`
/// and enough points have a depth. Undetermined steps are dropped. Deterministic.
[[nodiscard]] VisualRotations visual_rotations(std::span<const TrackedStep> steps,
                                               const StereoRig& rig, bool use_depth);

}  // namespace km
