#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "modules/core/odometry.hpp"
#include "modules/core/pose_graph.hpp"
#include "modules/pose_graph/pgo_messages.hpp"
#include "modules/pose_graph/quadratic_problem.hpp"

namespace km {

/// An inlier closure between this robot and a peer.
struct InterEdge {
  std::uint32_t own = 0;    ///< Keyframe of this robot.
  std::uint32_t other = 0;  ///< Keyframe of the peer.
  bool from_own = true;
  SE3 T_from_to = SE3::Identity();
  double kappa = 1.0;
  double tau = 1.0;
};

/// Which closure of robot `self` an edge is: inside it, or to `peer`.
[[nodiscard]] ClosureId closure_id(RobotId self, const BlockEdge& edge);
[[nodiscard]] ClosureId closure_id(RobotId self, RobotId peer, const InterEdge& edge);

/// What one robot knows of the pose graph: its odometry, the closures that touch it, and which of
/// them are inliers. Closures and inlier sets may come in any order and repeatedly. An inlier set
/// counts once all its closures, and the keyframes of this robot they end on, have arrived; of the
/// sets of a robot pair the newest few are kept, so that the two ends can agree on one.
class LocalGraph {
 public:
  explicit LocalGraph(RobotId self) : self_(self) {}

  /// False, and ignored, unless it is this robot's next keyframe.
  /// Throws std::invalid_argument if its pose, covariance or vertical is not usable.
  bool add(const KeyframeOdometry& keyframe);
  /// False, and ignored, if it does not touch this robot, is known, or has no usable covariance.
  bool add(const Closure& closure);
  /// False, and ignored, if it does not concern this robot, is not newer than what is known, or
  /// names closures that are not between its robots.
  bool add(const InlierSet& set);
  /// Forgets a robot that has been restarted: its keyframes are others now.
  void forget(RobotId peer);

  [[nodiscard]] std::uint32_t keyframes() const { return keyframes_; }
  [[nodiscard]] std::uint32_t revision() const { return revision_; }

  /// Complete, nonempty edge sets, per peer the newest first.
  [[nodiscard]] std::vector<EdgeSetOffer> offers() const;
  /// Edges of an offered set; nullptr if it is not (or no longer) held.
  [[nodiscard]] const std::vector<InterEdge>* edges(RobotId peer, const EdgeSetId& id) const;

  /// Edges of the newest complete set with a peer; nullptr if there is none.
  [[nodiscard]] const std::vector<InterEdge>* newest_edges(RobotId peer) const;

  /// Odometry and inlier closures inside this robot.
  [[nodiscard]] std::vector<BlockEdge> own_edges() const;
  /// Pose of keyframe 0 in the frame of odometry; the identity before there is one.
  [[nodiscard]] const SE3& T_odom_first() const { return T_odom_first_; }
  /// Of all keyframes that told a vertical.
  [[nodiscard]] const std::vector<VerticalPrior>& verticals() const { return verticals_; }
  /// True if keyframe 0 told a vertical: then odometry's frame has z up.
  [[nodiscard]] bool upright() const { return !verticals_.empty() && verticals_[0].pose == 0; }
  /// Odometry step from keyframe i - 1 to i. Precondition: 0 < i < keyframes().
  [[nodiscard]] const SE3& step_to(std::uint32_t i) const { return odometry_[i - 1].T_i_j; }

 private:
  struct EdgeSet {
    EdgeSetId id;
    std::vector<InterEdge> edges;
  };

  void complete_sets();
  bool complete(const InlierSet& set);

  RobotId self_;
  SE3 T_odom_first_ = SE3::Identity();
  std::uint32_t keyframes_ = 0;
  std::uint32_t revision_ = 0;
  std::vector<BlockEdge> odometry_;
  std::vector<VerticalPrior> verticals_;
  std::vector<BlockEdge> intra_;
  std::map<ClosureId, BlockEdge> closures_;  // i, j: keyframes of different robots or of one
  std::map<RobotId, InlierSet> pending_;     // newest per peer, not yet complete
  std::map<RobotId, std::uint32_t> newest_version_;  // per peer, complete or not
  std::map<RobotId, std::vector<EdgeSet>> sets_;     // newest first
};

}  // namespace km
