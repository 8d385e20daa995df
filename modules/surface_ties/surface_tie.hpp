#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/surface_ties/surface_samples.hpp"

namespace km {

/// Assumptions on the surfaces of a tie.
struct SurfaceTieOptions {
  double spacing_m = 0.15;  ///< Spacing of the samples, see sample_plane_patches().
  /// Largest distance of two copies of one surface before the tie.
  double reach_m = 0.3;
  /// Largest standard deviation of the distance of copies after the tie. Larger: other surface.
  double max_noise_m = 0.05;
  /// Smallest standard deviation of that distance, whatever the residuals are.
  double min_noise_m = 0.005;
  /// Length along a surface over which its errors are equal.
  double correlation_m = 1.5;
  /// Standard deviation of an offset along the normals that all samples share, for example by a
  /// bias of depth.
  double bias_m = 0.005;
  /// For two surfaces of one robot, the largest keyframe_gap() of samples of one visit. Such
  /// samples form no pair. Absent for two robots.
  std::optional<KeyframeIndex> max_gap_keyframes = {};

  /// Neighbouring samples whose errors count as one: those of a square of side correlation_m.
  [[nodiscard]] double samples_per_error() const {
    return correlation_m * correlation_m / (spacing_m * spacing_m);
  }
};

enum class SurfaceTieStatus {
  kTied,       ///< The surfaces determine all six directions.
  kSlides,     ///< They fit, but slide along themselves in one direction or more.
  kTooLittle,  ///< Too few samples lie on the other surface.
  kMisfit,     ///< The surfaces do not fit: they are different, or the guess is wrong.
};

/// "tied", "slides", "too little", "misfit"
[[nodiscard]] const char* to_string(SurfaceTieStatus status);

struct [[nodiscard]] SurfaceTie {
  SurfaceTieStatus status = SurfaceTieStatus::kTooLittle;
  SE3 T_a_b = SE3::Identity();
  /// Covariance of T_a_b, see modules/core/covariance.hpp. Along directions in which the surfaces
  /// slide, it is 1e4 m^2.
  Matrix6 covariance = Matrix6::Identity();
  std::size_t pairs = 0;  ///< Samples of b with a copy in a that fit after the tie.
  /// Their share in the samples of b that have a copy within reach, in the direction in which this
  /// share is smallest.
  double fitting = 0.0;
  double noise_m = 0.0;     ///< Standard deviation of the distances of the pairs.
  int free_directions = 0;  ///< Number of directions, of 6, in which the surfaces slide.
};

/// Lays the surface `b` on the surface `a`: point-to-plane registration (Chen and Medioni, "Object
/// Modelling by Registration of Multiple Range Images", 1992), robust and from the guess `T_a_b`.
///
/// A sample of b is paired with the nearest sample of a that faces the same way (within 60 degrees)
/// and has no other known label. The pair counts if the offset along the surface is at most one
/// spacing: beyond, only one robot saw the surface. The two sides of a wall never form a pair. The
/// bound on the distance shrinks from `reach_m` to three standard deviations.
///
/// Along directions in which the surfaces slide along themselves, the guess is kept. The covariance
/// is that of the last linear least squares, which is valid for point-to-plane registration
/// (Bonnabel, Barczyk, Goulette, "On the Covariance of ICP-based Scan-matching Techniques", ACC
/// 2016). See README.md for correlated errors and bias.
///
/// `a` and `b` are in the frames of a and b [m]. O(n log n). Equal arguments give equal results.
[[nodiscard]] SurfaceTie tie_surfaces(const std::vector<SurfaceSample>& a,
                                      const std::vector<SurfaceSample>& b, const SE3& T_a_b,
                                      const SurfaceTieOptions& options = {});

/// A sample of b and the plane of a on which it should lie.
struct SurfacePair {
  Eigen::Vector3d point_b = Eigen::Vector3d::Zero();
  Eigen::Vector3d plane_a = Eigen::Vector3d::Zero();  ///< A point of the plane.
  Eigen::Vector3d normal_a = Eigen::Vector3d::UnitZ();
};

/// Distance of the pair along the normal [m].
[[nodiscard]] double residual_of(const SurfacePair& pair, const SE3& T_a_b);

/// Derivative of residual_of() by the tangent of T_a_b: [rotation; translation] on the right.
[[nodiscard]] Vector6 jacobian_of(const SurfacePair& pair, const SE3& T_a_b);

}  // namespace km
