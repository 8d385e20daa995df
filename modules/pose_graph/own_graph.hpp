#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "modules/core/odometry.hpp"
#include "modules/core/pose_graph.hpp"
#include "modules/pose_graph/odometry_noise.hpp"
#include "modules/pose_graph/pose_edge.hpp"
#include "modules/pose_graph/team_messages.hpp"
#include "modules/pose_graph/vertical_prior.hpp"

namespace km {

/// What one robot knows of the pose graph: its odometry, the closures that touch it, and which of
/// them are to be optimised. Closures and inlier sets may come in any order and repeatedly. An
/// inlier set counts once all its closures, and the keyframes of this robot they end on, have
/// arrived; of the edge sets of a robot pair the newest few are kept, so that the two ends can
/// agree on one. Not thread-safe.
///
/// A closure is a pair of keyframes and counts once, however often and from whichever end it was
/// measured: of several measurements the one that is_better(). Which one that
/// is follows from the measurements alone, and the identity of an edge set covers it: two ends
/// that have not exchanged all of them yet hold different sets.
class OwnGraph {
 public:
  explicit OwnGraph(RobotId self) : self_(self) {}

  /// Closures to one peer; more are not taken.
  static constexpr std::size_t kMaxClosures = 8000;

  /// False, and ignored, unless it is this robot's next keyframe.
  /// Throws std::invalid_argument if its pose, covariance or vertical is not usable.
  bool add(const KeyframeOdometry& keyframe);
  /// False, and ignored, if it does not touch this robot, has no usable covariance, is no better
  /// than what is known of its pair of keyframes, or is one too many: see is_full().
  bool add(const Closure& closure);
  /// False, and ignored, if it does not concern this robot, is not newer than what is known, or
  /// names closures that are not between its robots.
  bool add(const InlierSet& set);
  /// True if there is no room for this closure: it is not known, and kMaxClosures to its peer are.
  [[nodiscard]] bool is_full(const ClosureId& id) const;
  /// Forgets a robot that has been restarted: its keyframes are others now.
  void forget(RobotId peer);

  [[nodiscard]] std::uint32_t keyframes() const { return keyframes_; }
  /// Grows with every change of the own keyframes and of the closures inside this robot.
  [[nodiscard]] std::uint32_t revision() const { return revision_; }

  /// Complete, nonempty edge sets, per peer the newest first.
  [[nodiscard]] std::vector<EdgeSetOffer> offers() const;
  /// Edges of an offered set, ascending by id; nullptr if it is not (or no longer) held.
  [[nodiscard]] const std::vector<PoseEdge>* edges(RobotId peer, const EdgeSetId& id) const;
  /// Edges of the newest complete set with a peer; nullptr if there is none.
  [[nodiscard]] const std::vector<PoseEdge>* newest_edges(RobotId peer) const;

  /// Estimates the noise of odometry anew, from the closures inside this robot. From now on steps
  /// have the weights that follow.
  void judge_odometry();
  /// As last estimated; of no more noise than odometry claims before.
  [[nodiscard]] const OdometryNoise& odometry_noise() const { return odometry_noise_; }

  /// Odometry from each keyframe to the next, then closures inside this robot, ascending by id.
  [[nodiscard]] std::vector<PoseEdge> own_edges() const;
  /// Pose of keyframe 0 in the frame of odometry; the identity before there is one.
  [[nodiscard]] const SE3& T_odom_first() const { return T_odom_first_; }
  /// Of all keyframes that told a vertical.
  [[nodiscard]] const std::vector<VerticalPrior>& verticals() const { return verticals_; }
  /// True if keyframe 0 told a vertical: then odometry's frame has z up.
  [[nodiscard]] bool upright() const { return !verticals_.empty() && verticals_[0].pose == 0; }
  /// Odometry step from keyframe i - 1 to i. Precondition: 0 < i < keyframes().
  [[nodiscard]] const SE3& step_to(std::uint32_t i) const { return odometry_[i - 1].T_from_to; }
  /// Mean weights of a step of odometry; the default while there is none.
  [[nodiscard]] Precision mean_step_precision() const;

 private:
  struct EdgeSet {
    EdgeSetId id;
    std::vector<PoseEdge> edges;
  };
  // With one peer, or inside this robot.
  struct Sets {
    InlierSet newest;               // closures ascending, each once
    bool changed = true;            // `newest` is not what `complete` begins with
    std::vector<EdgeSet> complete;  // newest first
  };

  [[nodiscard]] RobotId peer_of(const ClosureId& id) const;
  void complete_sets();
  bool complete(Sets& sets) const;

  RobotId self_;
  SE3 T_odom_first_ = SE3::Identity();
  std::uint32_t keyframes_ = 0;
  std::uint32_t revision_ = 0;
  std::vector<PoseEdge> odometry_;  // with the precision that it claims
  OdometryNoise odometry_noise_;
  std::vector<VerticalPrior> verticals_;
  std::map<ClosureId, PoseEdge> closures_;
  std::map<RobotId, std::size_t> closures_to_;  // by peer; of `closures_`
  std::map<RobotId, Sets> sets_;                // by peer; `self_`: inside this robot
};

}  // namespace km
