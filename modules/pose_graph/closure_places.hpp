#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "modules/pose_graph/pose_edge.hpp"

namespace km {

/// Closures of a place are between the same robots, and their ends are within 10 keyframes of those
/// of its first closure, on both robots. Where one of them is false because two places look alike,
/// so are the others: they are one piece of evidence.
struct ClosurePlaces {
  std::vector<std::size_t> place_of = {};  ///< By closure; numbers begin at 0.
  std::vector<std::size_t> sizes = {};     ///< By place, its closures.

  /// By closure, what it counts if each place counts 1.
  [[nodiscard]] std::vector<double> weights() const;
};

/// In any order; the first closure of a place is the one with the lowest id. O(n log n) for n
/// closures of which few are beside each other.
[[nodiscard]] ClosurePlaces find_places(std::span<const PoseEdge> closures);

}  // namespace km
