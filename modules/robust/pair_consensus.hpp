#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <span>

#include "modules/core/data/single_pose.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/geometry/precision.hpp"
#include "modules/core/ids.hpp"
#include "modules/robust/session_graph.hpp"
#include "modules/tree_newton/pose_edge.hpp"

namespace km {

/// A rigid motion of all poses of robot b after which most closures of a pair a < b would fit,
/// while robot a does not move. Motions multiply from the left: T_world_kf becomes T * T_world_kf.
/// Positions are in the frame of the present poses. All but T is the same for both robots.
struct PairMotion {
  SinglePose T = {};
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< Mean end on the second robot, after T [m].
  SinglePose rival = {};  ///< The motion on which most of the other closures agree.
  Eigen::Vector3d rival_centre = Eigen::Vector3d::Zero();  ///< As `centre`, after `rival` [m].
  double radius_m = 0.0;  ///< RMS distance of the ends on both robots from their mean.
  /// Median distance of the ends on the second robot, moved by T, from their positions by the
  /// closures. Closures that agree on `rival` do not count. If closures of three rows or more agree
  /// on T, only those closures count.
  double spread_m = 0.0;
  double consistent_m = 0.0;  ///< Largest spread with which the closures are consistent.
  double votes = 0.0;        ///< Sum over the closures that agree on T, see ClosureGroups::votes().
  double rival_votes = 0.0;  ///< Sum over those that agree on `rival`; 0: there are none.
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

/// The motion of a pair whose robots a datum ties, see datum_ties(). Closures do not change it.
[[nodiscard]] PairMotion tied(const PairMotion& by_closures, const PoseEdge& tie,
                              const std::function<SE3(const KeyframeId&)>& pose);

/// Motions of robots after which most pairs fit. Each pair with consistent closures has one vote,
/// however many closures it has. Closures of a pair are consistent if their spread is at most a
/// quarter of the radius, or three standard deviations of a closure. If odometry between the
/// closures drifts too far, no single motion fits them. False closures do not agree on one motion,
/// either.
///
/// A pair is confirmed if the loop through some third robot closes. If the votes of the two motions
/// of a pair differ by less than two places, the one that is confirmed by more robots counts.
/// Motions are chained along the maximum spanning tree. Pairs with a vote come first, then those
/// with more such robots, then those with more votes of closures. The lowest robot does not move.
/// O(pairs * robots).
[[nodiscard]] std::map<RobotId, SE3> common_placement(const PairMotions& pairs);

/// The strength of the usual pair of robots: the lower median over all robots of the lower median
/// over the confirmed pairs of each robot. Pairs are confirmed as in common_placement(). One robot
/// of four takes part in half of all pairs, but only in a third of the pairs of each other robot.
/// Its claims about its own pairs can therefore make the result neither larger nor smaller than the
/// claims of the other robots. kUnlimited with fewer than kEnoughToOutvote robots, and if no pair
/// is confirmed. O(pairs * robots).
[[nodiscard]] Precision usual_strength(const PairMotions& pairs);

/// Limits the weights of the edges of a robot by the mean weights of a step that all members claim
/// (SessionGraph::step_precision, without their actual noise). No robot measures closures much more
/// precisely than the team measures a step of odometry. A robot that claims to would overrule all
/// others. Closures to other robots weigh at most four times as much as a step of the lower median
/// robot. The own edges of the robot are scaled together, so that its mean step weighs at most 1.25
/// times as much. With fewer than three members nothing is limited, because with two robots it is
/// unknown which one claims too much. All members know the same steps and compute the same limits.
void limit_precisions(SessionGraph& graph);

}  // namespace km
