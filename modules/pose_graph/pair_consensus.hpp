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
#include "modules/pose_graph/pose_edge.hpp"
#include "modules/pose_graph/team_messages.hpp"

namespace km {

/// By which motion of robot b most closures of a pair a < b would fit where a is placed. Motions
/// are from the left, T_world_kf becomes T * T_world_kf; positions in the frame of the placement.
struct PairMotion {
  SinglePose T = {};
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< [m] of b's ends.
  double radius_m = 0.0;                             ///< RMS distance of b's ends from there.
  /// Median distance of b's ends, moved by T, from where closures have them. If closures at three
  /// places or more agree on T, only the closures that agree count.
  double spread_m = 0.0;
  Precision strength = {.kappa = 0.0, .tau = 0.0};  ///< Weights of the closures, summed.
};

using PairMotions = std::map<std::pair<RobotId, RobotId>, PairMotion>;  // a < b

/// From so many robots on the others can outvote one of them.
inline constexpr std::size_t kEnoughToOutvote = 4;

inline constexpr Precision kUnlimited{.kappa = std::numeric_limits<double>::max(),
                                      .tau = std::numeric_limits<double>::max()};

/// Of the `closures` between `a` and another robot b, a < b; of very many a part is looked at, but
/// for `strength`. `pose`: where their ends are placed. nullopt if there are none.
[[nodiscard]] std::optional<PairMotion> motion_of_pair(
    std::span<const PoseEdge> closures, RobotId a,
    const std::function<SE3(const KeyframeId&)>& pose);

/// Motions of robots after which more pairs fit. Robots that come in one after the other are placed
/// by the closures of the first ones, true or not; here each pair whose closures agree has one
/// vote, however many closures it has: their spread is at most a quarter of the radius. Over a long
/// odometry no single motion fits, and false closures agree on none. A pair is borne out by third
/// robots on the way round which nothing is left over, robots are placed by the maximum spanning
/// tree of what bears pairs out, and as many as possible stay where they are. Empty if that is not
/// better by a pair, or if pairs with a vote do not join all of their robots; where they close no
/// circle, robots that only pairs without a vote had placed move. O(pairs * robots).
[[nodiscard]] std::map<RobotId, SE3> better_placement(const PairMotions& pairs);

/// Lower medians of kappa and of tau, each for itself. `values` are not empty.
[[nodiscard]] Precision lower_median(std::span<const Precision> values);

/// How strong a pair of robots is as a rule: of each robot its median pair, of all robots the
/// median one (lower medians), of the pairs that a third robot bears out; votes as above. One robot
/// of four has a hand in half of the pairs, but only in a third of those of each other robot, so
/// that what it says of its own makes this no larger and no smaller than what the others say.
/// kUnlimited of fewer than kEnoughToOutvote robots, and where no pair is borne out. O(pairs *
/// robots).
[[nodiscard]] Precision usual_strength(const PairMotions& pairs);

}  // namespace km
