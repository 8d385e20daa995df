#include "modules/pose_graph/newton/wire_blocks.hpp"

#include <algorithm>
#include <cmath>

namespace km {

using Eigen::Index;

std::vector<double> lower_triangles(const Eigen::MatrixXd& diagonal) {
  const Index B = diagonal.rows();
  std::vector<double> lower;
  for (Index c = 0; c < diagonal.cols(); ++c)
    for (Index r = c % B; r < B; ++r) lower.push_back(diagonal(r, c));
  return lower;
}

Eigen::MatrixXd from_lower_triangles(std::span<const double> lower, Index B) {
  const auto blocks = static_cast<Index>(lower.size()) / (B * (B + 1) / 2);
  Eigen::MatrixXd diagonal(B, B * blocks);
  auto value = lower.begin();
  for (Index k = 0; k < blocks; ++k)
    for (Index c = 0; c < B; ++c)
      for (Index r = c; r < B; ++r) diagonal(r, B * k + c) = diagonal(c, B * k + r) = *value++;
  return diagonal;
}

bool all_finite(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

}  // namespace km
