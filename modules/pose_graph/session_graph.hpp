#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/pose_graph.hpp"
#include "modules/pose_graph/closure_noise.hpp"
#include "modules/pose_graph/pose_edge.hpp"
#include "modules/pose_graph/vertical_prior.hpp"

namespace km {

/// Factor on the weights of a closure that is decided to be rejected where it stays an edge: its
/// ends stay in the problem, and it moves nothing.
inline constexpr double kRejectedWeight = 1e-6;

/// A robot's part of the graph that a session optimises, frozen when the session begins.
///
/// Both ends of a closure between robots hold it, with the same numbers. Public are the keyframes
/// that closures between robots end on, and keyframe 0; of a public pose everyone has the same
/// start, to the last bit (see SinglePose).
struct SessionGraph {
  RobotId self = 0;
  std::vector<SE3> start = {};         ///< T_world_kf of the own keyframes, in the session's frame.
  std::vector<PoseEdge> own = {};      ///< Odometry from each keyframe to the next, then closures.
  std::size_t odometry = 0;            ///< So many edges at the beginning of `own`.
  std::vector<PoseEdge> between = {};  ///< Closures to other members, ascending by id.
  std::vector<PoseEdge> to_absent = {};  ///< Closures to robots that have gone: poses held fixed.
  /// Start of the others' public poses, those of absent ones included.
  std::map<KeyframeId, SE3> told = {};
  /// Mean weights of one step of odometry, as every robot tells its own.
  std::map<RobotId, Precision> step_precision = {};
  std::vector<VerticalPrior> verticals = {};  ///< Of own poses; empty unless `upright`.
  bool upright = false;                       ///< All members have verticals: the frame has z up.
  /// Decided in sessions before: kept or rejected. Closures that are not named are undecided.
  std::map<ClosureId, bool> decided = {};
  std::set<ClosureId> trusted = {};  ///< Between robots, and not to be weighed; the same for both.
  /// Cycles through closures that this robot counted in earlier sessions.
  ClosureNoiseRecord noise = {};
};

/// A robot's place in the tree of a session, whose edges are links between robots that hear each
/// other.
struct TreePlace {
  std::optional<RobotId> parent = {};  ///< nullopt: the root.
  std::vector<RobotId> children = {};  ///< Ascending.
  std::vector<RobotId> members = {};   ///< Of the whole session, this one included; ascending.
  RobotId root = 0;                    ///< The member without a parent.
};

}  // namespace km
