#pragma once

#include <cstddef>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/loop_closure/ransac.hpp"
#include "modules/loop_closure/transfer_error.hpp"

namespace km {

/// T_a_b that minimises sum |p_a - T_a_b p_b|^2 in closed form (Arun, Huang, Blostein,
/// "Least-Squares Fitting of Two 3-D Point Sets", PAMI 1987, with the reflection resolved as in
/// their Sec. IV). nullopt if there are fewer than three points or they lie on a line, where the
/// rotation about it is free. Throws std::invalid_argument if the lengths differ.
[[nodiscard]] std::optional<SE3> align_points(std::span<const Eigen::Vector3d> points_a,
                                              std::span<const Eigen::Vector3d> points_b);

/// Two image points taken for the same scene point. At least one has depth.
struct ImagePair {
  ImagePoint a;
  ImagePoint b;
};

/// Squared error of a pair in standard deviations and its degrees of freedom, from the side that
/// has depth (from a if both have).
struct PairError {
  double chi2 = 0.0;
  int dim = 0;  ///< 0: behind a camera.

  /// chi2 over the 99 % quantile of its distribution: at most 1 for an inlier.
  [[nodiscard]] double relative() const;
};

[[nodiscard]] PairError pair_error(const SE3& T_a_b, const ImagePair& pair);

/// A pose with the information matrix of its tangent.
struct PoseFit {
  SE3 T_a_b = SE3::Identity();
  Matrix6 information = Matrix6::Zero();  ///< Gauss-Newton, with robust weights.
  double chi2 = 0.0;                      ///< Weighted sum over the pairs used.
  double freedom = 0.0;                   ///< Weighted number of residuals.
};

/// Minimises the transfer errors of `pairs[indices]` over the pose from `T_a_b` by Gauss-Newton
/// with Cauchy weights. nullopt if the pairs leave the pose undetermined or it does not converge to
/// finite numbers.
[[nodiscard]] std::optional<PoseFit> refine_pose(const SE3& T_a_b, std::span<const ImagePair> pairs,
                                                 std::span<const std::size_t> indices,
                                                 int max_iterations);

/// What is left of `fit.information` when the `share` of the pairs that hold the pose the most
/// (largest trace of their information in units of the whole) is taken away, at least two. A pose
/// that a few pairs decide, which may be wrong ones that fit by chance, loses most of it.
[[nodiscard]] Matrix6 information_without_strongest(const PoseFit& fit,
                                                    std::span<const ImagePair> pairs,
                                                    std::span<const std::size_t> indices,
                                                    double share);

/// Relative pose of two stereo cameras from matches with outliers: Arun's method on three pairs
/// with depth on both sides (as Chang et al., "Kimera-Multi", ICRA 2021, Sec. III-A), polished on
/// those three by their image errors (which count far more than the depths), inside RANSAC. Inliers
/// are decided in the images (pair_error()), not by a metric radius, so that far points count for
/// what they are worth.
[[nodiscard]] RansacResult<SE3> ransac_pose(std::span<const ImagePair> pairs,
                                            const RansacOptions& options, std::mt19937& rng);

}  // namespace km
