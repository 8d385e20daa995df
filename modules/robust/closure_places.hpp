#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/pose_graph.hpp"
#include "modules/tree_newton/pose_edge.hpp"

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

/// The odometry of robots a < b, aligned by a closure between them.
struct AlignedOdometry {
  ClosureId closure = {};
  SE3 T_a_b = SE3::Identity();                    ///< Between the frames of their odometry.
  Eigen::Vector3d p_b = Eigen::Vector3d::Zero();  ///< End of the closure on robot b [m].
};

/// Precondition: the closure is between two robots.
[[nodiscard]] AlignedOdometry align_odometry(const Closure& closure);

/// Number of places at which closures that are not `kept` agree with those of another place.
///
/// In a hall of equal aisles, many places are mistaken for others in the same way. The closures of
/// these places agree on a wrong relative pose of the two robots, as true ones do. Two closures
/// agree if their transforms differ by at most 0.1 rad. At the end of one of them the difference
/// must be at most 0.5 m and 2 % of the distance of their ends. If closures of at least two places
/// agree, their places are counted. A closure that agrees with one of `kept` within 0.1 rad, 1 m
/// and 2 % does not count, because it may be true and inaccurate.
///
/// `all` are the closures between two robots, `kept` some of them, ascending. Drift of odometry
/// between places hides rivals. If there are more than 500 closures of a kind, an even selection
/// counts. O(n^2) for n closures.
[[nodiscard]] std::size_t count_rival_places(std::span<const AlignedOdometry> all,
                                             std::span<const ClosureId> kept);

}  // namespace km
