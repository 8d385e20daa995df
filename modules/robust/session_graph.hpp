#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <vector>

#include "modules/core/data/pose_graph.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/robust/closure_noise.hpp"
#include "modules/tree_newton/pose_edge.hpp"
#include "modules/tree_newton/vertical_prior.hpp"

namespace km {

/// Factor on the weights of a rejected closure that remains an edge (rbcd). The pose at its other
/// end remains in the problem, and the influence of the closure is negligible.
inline constexpr double kRejectedWeight = 1e-6;

/// The part of the graph of a session that one robot knows, frozen when the session begins.
///
/// A closure between two robots is in the parts of both, with equal measurements and weights. The
/// public keyframes are keyframe 0 and the keyframes on which closures between robots end. The
/// start of a public pose is equal on all robots, to the last bit (see SinglePose).
struct SessionGraph {
  RobotId self = 0;
  std::vector<SE3> start = {};         ///< T_world_kf of the own keyframes, in the session's frame.
  std::vector<PoseEdge> own = {};      ///< Odometry from each keyframe to the next, then closures.
  std::size_t odometry = 0;            ///< Number of steps of odometry at the beginning of `own`.
  std::vector<PoseEdge> between = {};  ///< Closures to other members, ascending by id.
  /// Closures to held poses of robots out of reach; only kept ones, unless all are trusted.
  std::vector<PoseEdge> to_absent = {};
  /// Start of the public poses of other robots, including absent robots.
  std::map<KeyframeId, SE3> public_poses = {};
  /// Mean actual weights of one step of odometry, as reported by each robot.
  std::map<RobotId, Precision> step_precision = {};
  /// Actual over claimed weights of odometry, and of the closures inside each robot, by itself.
  std::map<RobotId, Precision> odometry_precision = {}, closure_precision = {};
  LaterRuns later_runs = {};  ///< Those of other robots by their public keyframes.
  /// Positions of own keyframes relative to keyframe 0, never weighed: see fix_edges().
  std::vector<PoseEdge> fixes = {};
  /// Edges to keyframe 0 of other members in the datum of this robot, never weighed: see
  /// datum_ties(). The robots of both ends know each of them.
  std::vector<PoseEdge> datum_ties = {};
  std::vector<VerticalPrior> verticals = {};  ///< Priors of own poses; empty unless `upright`.
  bool upright = false;                       ///< All members have verticals: the frame has z up.
  KeyframeId origin = {};                     ///< Covariances are relative to this keyframe.
  /// Second look of a session: `start` is the solution without the deferred closures.
  bool again = false;
  double first_barc = 0.0;  ///< Second look: largest residual of an inlier in the first [sigma].
  /// Kept or rejected closures: in a second look those of the first one. Closures without an entry
  /// are undecided.
  std::map<ClosureId, bool> decided = {};
  ClosureNoiseRecord noise = {};  ///< In a second look the noise by the first one.
};

/// The place of a robot in the tree of a session. The edges of the tree are links, or paths over
/// other robots where members have no link.
struct TreePlace {
  std::optional<RobotId> parent = {};  ///< nullopt: the root.
  std::vector<RobotId> children = {};  ///< Ascending.
  std::vector<RobotId> members = {};   ///< All of the session, ascending.
  RobotId root = 0;                    ///< The member without a parent.
};

}  // namespace km
