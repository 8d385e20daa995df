#pragma once

#include <array>
#include <optional>
#include <span>

#include "modules/core/geometry/geometry.hpp"

namespace km {

/// The lower triangle of a 6x6 matrix L by rows, in single precision.
using CovarianceRoot = std::array<float, 21>;

/// L with L * L^T = Sigma, by Cholesky's method. In single precision L keeps a covariance positive
/// semi-definite, and its small eigenvalues. Sigma itself in single precision does neither.
/// Precondition: is_covariance(Sigma). Directions without variance are columns of zeros.
[[nodiscard]] CovarianceRoot covariance_root(const Matrix6& Sigma);

/// L * L^T; nullopt unless every element of it is finite.
[[nodiscard]] std::optional<Matrix6> covariance_of(std::span<const float, 21> root);

}  // namespace km
