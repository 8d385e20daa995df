#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "modules/pose_graph/pose_edge.hpp"

namespace km {

/// The places of a list of closures. The closures of a place are between the same robots, and their
/// ends are within 10 keyframes of the ends of its first closure, on both robots. If one closure is
/// false because two parts of the environment look alike, the other closures of its place are
/// false, too. The closures of a place are therefore one piece of evidence.
struct ClosurePlaces {
  std::vector<std::size_t> place_of = {};  ///< Number of the place of each closure, from 0.
  std::vector<std::size_t> sizes = {};     ///< Number of closures of each place.

  /// Weight of each closure such that the weights in each place sum to 1.
  [[nodiscard]] std::vector<double> weights() const;
};

/// Closures may have any order; the first closure of a place is the one with the lowest id. O(n log
/// n) for n closures if few are near each other.
[[nodiscard]] ClosurePlaces find_places(std::span<const PoseEdge> closures);

}  // namespace km
