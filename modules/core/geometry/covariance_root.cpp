#include "modules/core/geometry/covariance_root.hpp"

#include <cmath>
#include <cstddef>

namespace km {
namespace {

// A smaller share of a variance that is left over for its direction is rounding.
constexpr double kRounding = 1e-14;

}  // namespace

CovarianceRoot covariance_root(const Matrix6& Sigma) {
  Matrix6 L = Matrix6::Zero();
  for (int j = 0; j < 6; ++j) {
    const double variance = Sigma(j, j) - L.row(j).head(j).squaredNorm();
    if (!(variance > kRounding * Sigma(j, j))) continue;
    L(j, j) = std::sqrt(variance);
    for (int i = j + 1; i < 6; ++i)
      L(i, j) = (Sigma(i, j) - L.row(i).head(j).dot(L.row(j).head(j))) / L(j, j);
  }
  CovarianceRoot root;
  std::size_t k = 0;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j) root[k++] = static_cast<float>(L(i, j));
  return root;
}

std::optional<Matrix6> covariance_of(std::span<const float, 21> root) {
  Matrix6 L = Matrix6::Zero();
  std::size_t k = 0;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j) L(i, j) = static_cast<double>(root[k++]);
  const Matrix6 Sigma = L * L.transpose();
  return Sigma.allFinite() ? std::optional(Sigma) : std::nullopt;
}

}  // namespace km
