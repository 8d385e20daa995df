#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "modules/core/data/pose_graph.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/tree_newton/pose_edge.hpp"

namespace km {

/// The robot that counts as the first one of two, for closures between two robots: the one on which
/// the sum of the indices of their ends is lower. Ids decide only if the sums are equal. Decisions
/// on a pair begin at its first robot, and so do not depend on the ids of robots.
[[nodiscard]] RobotId first_robot(std::span<const PoseEdge> closures);

/// Ascending, each from its end on the first robot, with its index among the closures.
using ClosureOrder = std::vector<std::pair<ClosureId, std::size_t>>;
[[nodiscard]] ClosureOrder order_of(std::span<const PoseEdge> closures);

/// Largest number of steps of odometry between closures that are near each other.
inline constexpr std::uint32_t kNearSteps = 10;

/// Largest sum of the votes of the closures of a place.
inline constexpr double kVotesOfPlace = 3.0;

/// Groups of closures, each closure in one of them.
struct ClosureGroups {
  std::vector<std::size_t> group_of = {};  ///< Number of the group of each closure, from 0.
  std::vector<std::size_t> sizes = {};     ///< Number of closures of each group.

  /// Weight of each closure such that the weights in each group sum to 1.
  [[nodiscard]] std::vector<double> weights() const;
  /// Weight of each closure in a vote: at most 1 for a closure and kVotesOfPlace for a group. Three
  /// closures that agree with each other are not false by chance, but they may be false together.
  [[nodiscard]] std::vector<double> votes() const;
};

/// The rows of closures. Neighbours are closures between the same two robots whose ends are within
/// 10 keyframes on both robots. A row has all neighbours of its closures.
/// If one closure is false because two parts of the environment look alike, the other closures of
/// its row are false, too. The closures of a row are therefore one piece of evidence. Rows are
/// numbered by their lowest ids. O(n log n) for n closures if few are near each other.
[[nodiscard]] ClosureGroups find_rows(std::span<const PoseEdge> closures);

/// The places of closures inside one robot, or between two robots: parts of rows. The ends of the
/// closures of a place are within 10 keyframes of the ends of its first closure, on both robots. A
/// place is one observation of noise.
[[nodiscard]] ClosureGroups find_places(std::span<const PoseEdge> closures);

/// The odometry of robots a < b, aligned by a closure between them.
struct AlignedOdometry {
  ClosureId closure = {};
  SE3 T_a_b = SE3::Identity();                    ///< Between the frames of their odometry.
  Eigen::Vector3d p_b = Eigen::Vector3d::Zero();  ///< End of the closure on robot b [m].
};

/// Precondition: the closure is between two robots.
[[nodiscard]] AlignedOdometry align_odometry(const Closure& closure);

/// Number of rows with closures that are not `kept` and agree with those of another row.
///
/// In a hall of equal aisles, many places are mistaken for others in the same way. The closures of
/// these rows agree on a wrong relative pose of the two robots, as true ones do. Two closures
/// agree if their transforms differ by at most 0.1 rad. At the end of one of them the difference
/// must be at most 0.5 m and 2 % of the distance of their ends. If closures of at least two rows
/// agree, these rows are counted. A closure that agrees with one of `kept` within 0.1 rad, 1 m
/// and 2 % does not count, because it may be true and inaccurate.
///
/// `all` are the closures between two robots, `kept` some of them, ascending. Drift of odometry
/// between rows hides rivals. If there are more than 500 closures of a kind, an even selection
/// counts. O(n^2) for n closures.
[[nodiscard]] std::size_t count_rival_rows(std::span<const AlignedOdometry> all,
                                           std::span<const ClosureId> kept);

}  // namespace km
