#pragma once

#include <optional>

#include "modules/core/geometry.hpp"
#include "modules/core/pose_graph.hpp"
#include "modules/core/precision.hpp"

namespace km {

/// A relative pose between two keyframes with its weights in the cost of pose graphs (see
/// Precision): the one form in which edges are held, told and solved. Odometry, closures inside a
/// robot and closures between robots alike.
struct PoseEdge {
  KeyframeId from;
  KeyframeId to;
  SE3 T_from_to = SE3::Identity();
  Precision precision = {};

  /// Unordered: which end the measurement starts at does not matter.
  [[nodiscard]] ClosureId id() const { return closure_id(from, to); }
  /// The end that is not on `robot`. Precondition: exactly one is.
  [[nodiscard]] const KeyframeId& other(RobotId robot) const {
    return from.robot == robot ? to : from;
  }
  /// The end on `robot`. Precondition: one is.
  [[nodiscard]] const KeyframeId& end_on(RobotId robot) const {
    return from.robot == robot ? from : to;
  }
};

/// nullopt for measurements that would spoil the numbers of everyone: beyond
/// measurement_limits.hpp.
[[nodiscard]] std::optional<PoseEdge> pose_edge(const RelativePose& measured);

/// Of two measurements of one pair of keyframes, whether `a` is the one that counts: the one with
/// the least trace of covariance. A total order, the same for all robots.
[[nodiscard]] bool is_better(const PoseEdge& a, const PoseEdge& b);

}  // namespace km
