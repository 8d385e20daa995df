#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace km {

// Symmetric blocks side by side, B x (B n), to and from what crosses the network: of each the lower
// triangle, column-major.

[[nodiscard]] std::vector<double> lower_triangles(const Eigen::MatrixXd& diagonal);
/// `lower` is of a whole number of triangles.
[[nodiscard]] Eigen::MatrixXd from_lower_triangles(std::span<const double> lower, Eigen::Index B);

[[nodiscard]] bool all_finite(std::span<const double> values);

}  // namespace km
