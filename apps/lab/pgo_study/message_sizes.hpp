#pragma once

#include <Eigen/Core>
#include <cstddef>

namespace km {

// Bytes that a message of the methods in this module would take as a solver message between robots
// (see SolverMessage). The head takes 4 bytes for kind and round. The content takes
//     public poses   2 for the index of each and 4 rank floats, 16 rank: m (2 + 16 rank).
// The methods run in one process and encode no messages.

inline constexpr std::size_t kMessageHeader = 1 + 3;  ///< Kind, and the round as a varint.

[[nodiscard]] constexpr std::size_t bytes_of_poses(std::size_t poses, Eigen::Index rank) {
  constexpr std::size_t kIndex = 2;
  return poses * (kIndex + 4 * sizeof(float) * static_cast<std::size_t>(rank));
}

}  // namespace km
