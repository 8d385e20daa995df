#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/pose_graph/pose_edge.hpp"
#include "modules/pose_graph/team_messages.hpp"

namespace km {

/// By which motion of robot b most closures of a pair a < b would fit where a is placed. Motions
/// are from the left, T_world_kf becomes T * T_world_kf; positions in the frame of the placement.
struct PairMotion {
  SinglePose T = {};
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< [m] of b's ends.
  double radius_m = 0.0;                             ///< RMS distance of b's ends from there.
  double spread_m =
      0.0;  ///< Median distance of b's ends, moved by T, from where closures have them.
};

using PairMotions = std::map<std::pair<RobotId, RobotId>, PairMotion>;  // a < b

/// Of the `closures` between `a` and another robot b, a < b; of very many a part is looked at.
/// `pose`: where their ends are placed. nullopt if there are none.
[[nodiscard]] std::optional<PairMotion> motion_of_pair(
    std::span<const PoseEdge> closures, RobotId a,
    const std::function<SE3(const KeyframeId&)>& pose);

/// Motions of robots after which more pairs fit. Robots that come in one after the other are placed
/// by the closures of the first ones, true or not; here each pair has one vote, however
/// many closures it has. A pair is borne out by third robots on the way round which nothing is left
/// over, robots are placed by the maximum spanning tree of what bears pairs out, and as many as
/// possible stay where they are. Empty if that is not better by a pair. `pairs` join all robots.
/// O(pairs * robots).
[[nodiscard]] std::map<RobotId, SE3> better_placement(const PairMotions& pairs);

}  // namespace km
