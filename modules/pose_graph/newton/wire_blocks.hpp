#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/pose_graph/newton/newton_messages.hpp"

namespace km {

// Symmetric blocks side by side, B x (B n), to and from what crosses the network: of each the lower
// triangle, column-major.

[[nodiscard]] std::vector<double> lower_triangles(const Eigen::MatrixXd& diagonal);
/// `lower` is of a whole number of triangles.
[[nodiscard]] Eigen::MatrixXd from_lower_triangles(std::span<const double> lower, Eigen::Index B);

/// Of blocks side by side, B x (B n), those marked in `present` from place `first` on.
[[nodiscard]] Eigen::MatrixXd gathered(const Eigen::MatrixXd& blocks,
                                       const std::vector<bool>& present, std::size_t first);
/// The way back to n blocks, zeros elsewhere. Precondition: as many are marked as `some` has.
[[nodiscard]] Eigen::MatrixXd scattered(const Eigen::MatrixXd& some, std::size_t n,
                                        const std::vector<bool>& present, std::size_t first);

/// Of the blocks of a share's Schur complement, the diagonal ones first, those that travel: those
/// of kept poses that are not zero, those of couplings that are not, or of which no edge tells.
[[nodiscard]] std::vector<bool> blocks_to_send(const NewtonShare& share);

/// Bits to bytes, the first lowest.
[[nodiscard]] std::vector<std::uint8_t> packed(const std::vector<bool>& bits);
/// Precondition: there are enough bytes.
[[nodiscard]] std::vector<bool> unpacked(std::span<const std::uint8_t> bytes, std::size_t bits);

[[nodiscard]] bool all_finite(std::span<const double> values);

}  // namespace km
