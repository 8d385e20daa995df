#pragma once

#include <cmath>
#include <numbers>

namespace km {

/// Probability that the squared Mahalanobis length of a 6-dimensional normal vector is below `x`:
/// the chi-squared distribution with 6 degrees of freedom, in closed form.
inline double chi_squared_6(double x) {
  const double half = 0.5 * x;
  return 1.0 - std::exp(-half) * (1.0 + half + 0.5 * half * half);
}

/// The x with chi_squared_6(x) = probability, to rounding. Precondition: 0 < probability < 1.
inline double chi_squared_6_quantile(double probability) {
  double below = 0.0, above = 1000.0;
  for (int i = 0; i < 64; ++i) {
    const double middle = 0.5 * (below + above);
    (chi_squared_6(middle) < probability ? below : above) = middle;
  }
  return 0.5 * (below + above);
}

/// Quantile of the squared length of the tangent vector of a pose. It has 6 degrees of freedom, and
/// in the plane (`dimension` 2) 3.
inline double pose_quantile(double probability, int dimension) {
  if (dimension == 3) return chi_squared_6_quantile(probability);
  const auto chi_squared_3 = [](double x) {
    return std::erf(std::sqrt(0.5 * x)) -
           std::sqrt(2.0 * x / std::numbers::pi) * std::exp(-0.5 * x);
  };
  double below = 0.0, above = 1000.0;
  for (int i = 0; i < 64; ++i) {
    const double middle = 0.5 * (below + above);
    (chi_squared_3(middle) < probability ? below : above) = middle;
  }
  return 0.5 * (below + above);
}

}  // namespace km
