#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/data/pose_graph.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/geometry/precision.hpp"

namespace km {

/// A relative pose between two keyframes with its weights in the cost of pose graphs (see
/// Precision). The module stores, sends and solves all edges in this form: odometry, closures
/// inside a robot and closures between robots.
struct PoseEdge {
  KeyframeId from;
  KeyframeId to;
  SE3 T_from_to = SE3::Identity();
  Precision precision = {};

  /// Independent of the direction of the measurement.
  [[nodiscard]] ClosureId id() const { return closure_id(from, to); }
  /// The end that is not on `robot`. Precondition: exactly one is.
  [[nodiscard]] const KeyframeId& other(RobotId robot) const {
    return from.robot == robot ? to : from;
  }
  /// The robot at the other end; `robot` itself for an edge inside it. Precondition: one end is on
  /// `robot`.
  [[nodiscard]] RobotId peer_of(RobotId robot) const {
    return from.robot == robot ? to.robot : from.robot;
  }
  /// The end on `robot`. Precondition: one is.
  [[nodiscard]] const KeyframeId& end_on(RobotId robot) const {
    return from.robot == robot ? from : to;
  }
};

/// Number of steps of odometry between two keyframes of one robot.
[[nodiscard]] constexpr KeyframeIndex steps_between(const KeyframeId& a, const KeyframeId& b) {
  return a.index < b.index ? b.index - a.index : a.index - b.index;
}

/// True for the step between two runs of a robot, see kUnknownStep_m.
[[nodiscard]] bool is_unknown_step(const PoseEdge& step);

/// First keyframes of the runs of each robot after its first one, ascending. A step to such a
/// keyframe is unknown.
using LaterRuns = std::map<RobotId, std::vector<KeyframeIndex>>;

/// A step of this kind, from `from` to the next keyframe.
[[nodiscard]] PoseEdge unknown_step(const KeyframeId& from);

/// nullopt for measurements beyond measurement_limits.hpp: they would corrupt the solution of the
/// whole team.
[[nodiscard]] std::optional<PoseEdge> pose_edge(const RelativePose& measured);

/// True if `a` and not `b` counts, for two measurements of one pair of keyframes: the one with the
/// smaller trace of the covariance. A total order, equal on all robots.
[[nodiscard]] bool is_better(const PoseEdge& a, const PoseEdge& b);

/// Square root of the cost of an edge with weight 1 [sigma]. For small Gaussian noise with these
/// precisions, its square is chi-squared distributed.
[[nodiscard]] double residual_of(const PoseEdge& edge, const SE3& T_world_from,
                                 const SE3& T_world_to);

/// True if at most 3 % of the closures inside one robot have a residual above `barc` at `poses`. If
/// more closures are false, a robot alone decides worse than a team. In parking-garage with 10 % of
/// false closures, a false one would be kept (RMSE 2.5 m).
[[nodiscard]] bool mostly_fit(std::span<const PoseEdge> closures, const std::vector<SE3>& poses,
                              double barc);

}  // namespace km
