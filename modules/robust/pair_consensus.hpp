#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/precision.hpp"
#include "modules/core/single_pose.hpp"
#include "modules/robust/session_graph.hpp"
#include "modules/tree_newton/pose_edge.hpp"

namespace km {

/// A rigid motion of all poses of robot b after which most closures of a pair a < b would fit,
/// while robot a does not move. Motions multiply from the left: T_world_kf becomes T * T_world_kf.
/// Positions are in the frame of the present poses.
struct PairMotion {
  SinglePose T = {};
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< Mean position of the ends on b [m].
  double radius_m = 0.0;  ///< RMS distance of the ends on b from `centre`.
  /// Median distance of the ends on b, moved by T, from their positions by the closures.
  /// If closures at three places or more agree on T, only those closures count.
  double spread_m = 0.0;
  Precision strength = {.kappa = 0.0, .tau = 0.0};  ///< Sum of the weights of the closures.
};

using PairMotions = std::map<std::pair<RobotId, RobotId>, PairMotion>;  // a < b

/// Smallest number of robots in which the others can outvote one robot.
inline constexpr std::size_t kEnoughToOutvote = 4;

inline constexpr Precision kUnlimited{.kappa = std::numeric_limits<double>::max(),
                                      .tau = std::numeric_limits<double>::max()};

/// The motion of the `closures` between `a` and another robot b, a < b. If there are very many,
/// only a subset is used, except for `strength`. `pose`: present poses of their ends. nullopt if
/// there are no closures.
[[nodiscard]] std::optional<PairMotion> motion_of_pair(
    std::span<const PoseEdge> closures, RobotId a,
    const std::function<SE3(const KeyframeId&)>& pose);

/// Motions of robots after which more pairs fit. Robots enter the frame one after the other, each
/// by its closures to earlier robots, which may be false. Here each pair with consistent closures
/// has one vote, however many closures it has. Closures of a pair are consistent if their spread is
/// at most a quarter of the radius. If odometry between the closures drifts too far, no single
/// motion fits them. False closures do not agree on one motion, either.
///
/// A pair is confirmed if the loop through some third robot closes. Motions are chained along the
/// maximum spanning tree over the number of such robots per pair. All motions together are then
/// shifted so that as many robots as possible do not move. The result is empty if the gain in
/// fitting pairs, each counted in [0, 1], is below 0.5. It is also empty if the pairs with a vote
/// do not connect all of their robots. If these pairs form no loop, only robots that entered the
/// frame by pairs without a vote move. O(pairs * robots).
[[nodiscard]] std::map<RobotId, SE3> better_placement(const PairMotions& pairs);

/// Lower medians of kappa and of tau, independently. Precondition: `values` is not empty.
[[nodiscard]] Precision lower_median(std::span<const Precision> values);

/// The strength of the usual pair of robots: the lower median over all robots of the lower median
/// over the confirmed pairs of each robot. Pairs are confirmed as in better_placement(). One robot
/// of four takes part in half of all pairs, but only in a third of the pairs of each other robot.
/// Its claims about its own pairs can therefore make the result neither larger nor smaller than the
/// claims of the other robots. kUnlimited with fewer than kEnoughToOutvote robots, and if no pair
/// is confirmed. O(pairs * robots).
[[nodiscard]] Precision usual_strength(const PairMotions& pairs);

/// Limits the weights of the edges of a robot by the mean weights of a step of all members
/// (SessionGraph::step_precision). No robot measures closures much more precisely than the team
/// measures a step of odometry. A robot that claims to would overrule all others. Closures to other
/// robots weigh at most four times as much as a step of the lower median robot. The own edges of
/// the robot are scaled together, so that its mean step weighs at most 1.25 times as much. With
/// fewer than three members nothing is limited, because with two robots it is unknown which one
/// claims too much. All members know the same steps and compute the same limits.
void limit_precisions(SessionGraph& graph);

}  // namespace km
