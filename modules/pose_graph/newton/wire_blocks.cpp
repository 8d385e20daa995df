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

std::vector<bool> blocks_to_send(const NewtonShare& share) {
  const BlockMatrix& schur = share.schur;
  const Index B = schur.block();
  std::vector<bool> present;
  if (B == 0) return present;
  for (Index k = 0; k < schur.diagonal.cols() / B; ++k)
    present.push_back(!schur.at(static_cast<int>(k)).isZero(0.0));
  const std::size_t poses = present.size();
  for (Index p = 0; p < schur.coupling.cols() / B; ++p) present.push_back(true);
  for (const KeptEdge& e : share.edges)
    present[poses + static_cast<std::size_t>(e.pair)] = !schur.between(e.pair).isZero(0.0);
  return present;
}

Eigen::MatrixXd gathered(const Eigen::MatrixXd& blocks, const std::vector<bool>& present,
                         std::size_t first) {
  const Index B = blocks.rows();
  Eigen::MatrixXd some(B, blocks.cols());
  Index filled = 0;
  for (Index k = 0; B > 0 && k < blocks.cols() / B; ++k)
    if (present[first + static_cast<std::size_t>(k)])
      some.middleCols(B * filled++, B) = blocks.middleCols(B * k, B);
  return some.leftCols(B * filled);
}

Eigen::MatrixXd scattered(const Eigen::MatrixXd& some, std::size_t n,
                          const std::vector<bool>& present, std::size_t first) {
  const Index B = some.rows();
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(B, B * static_cast<Index>(n));
  Index taken = 0;
  for (std::size_t k = 0; k < n; ++k)
    if (present[first + k])
      all.middleCols(B * static_cast<Index>(k), B) = some.middleCols(B * taken++, B);
  return all;
}

std::vector<std::uint8_t> packed(const std::vector<bool>& bits) {
  std::vector<std::uint8_t> bytes((bits.size() + 7) / 8, 0);
  for (std::size_t k = 0; k < bits.size(); ++k)
    if (bits[k]) bytes[k / 8] = static_cast<std::uint8_t>(bytes[k / 8] | (1U << (k % 8)));
  return bytes;
}

std::vector<bool> unpacked(std::span<const std::uint8_t> bytes, std::size_t bits) {
  std::vector<bool> result;
  for (std::size_t k = 0; k < bits; ++k) result.push_back(((bytes[k / 8] >> (k % 8)) & 1U) != 0);
  return result;
}

bool all_finite(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

}  // namespace km
