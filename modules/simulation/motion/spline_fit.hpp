#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace km {

/// A uniform B-spline of degree 5 to be fitted, in units of its interval: control k has most weight
/// at position k - 2, the curve covers [0, controls - 5].
struct SplineFitOptions {
  std::size_t controls = 0;
  double noise = 1.0;      ///< Standard deviation of the values.
  double roughness = 1.0;  ///< Standard deviation of third differences of successive controls.
};

/// Controls (one row each) of the curve through `values` (one row per position) that minimises
///   sum rho(|values - curve|^2 / noise^2) + sum |third differences of controls|^2 / roughness^2,
/// where rho is Cauchy's, by reweighted least squares: outliers lose weight. Positions ascend
/// within the curve. The band of the normal equations has width 6: O(values + controls).
[[nodiscard]] Eigen::MatrixXd fit_spline(std::span<const double> positions,
                                         const Eigen::MatrixXd& values,
                                         const SplineFitOptions& options);

}  // namespace km
