#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "modules/core/data/odometry.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/core/data/position_fix.hpp"
#include "modules/robust/closure_places.hpp"
#include "modules/robust/odometry_noise.hpp"
#include "modules/session/team_messages.hpp"
#include "modules/tree_newton/pose_edge.hpp"
#include "modules/tree_newton/vertical_prior.hpp"

namespace km {

/// The part of the pose graph that one robot knows: its odometry, the closures that end on it, and
/// the inlier sets, which name the closures to optimise. Closures and inlier sets may arrive in any
/// order and repeatedly. Once all closures of an inlier set, and the keyframes of this robot on
/// which they end, have arrived, the set becomes an edge set: the closures with their measurements.
/// The newest few edge sets of each robot pair are kept, so that both robots can agree on one.
/// Inside this robot, only the newest set is kept. Not thread-safe.
///
/// A pair of keyframes identifies a closure. The closure counts once, however often and from
/// whichever end it was measured: of several measurements, the best one by is_better() counts. The
/// measurements alone determine which one is the best, and the id of an edge set has a hash of
/// them. Two robots that have not yet exchanged all measurements therefore hold edge sets with
/// different ids.
class OwnGraph {
 public:
  /// `dimension` 2: poses are planar.
  explicit OwnGraph(RobotId self, int dimension = 3) : self_(self), dimension_(dimension) {}

  /// Largest number of closures to one peer.
  static constexpr std::size_t kMaxClosures = 8000;

  /// False, without effect, unless it is the next keyframe of this robot. Throws
  /// std::invalid_argument if its pose, covariance or vertical is not usable.
  bool add(const KeyframeOdometry& keyframe);
  /// False, without effect, if the closure does not end on this robot or has no usable covariance.
  /// Also false if it is not better than the known closure of its pair of keyframes, or if
  /// is_full().
  bool add(const Closure& closure);
  /// False, without effect, if the set does not concern this robot, is not newer than the known
  /// one, or names closures that are not between its robots.
  bool add(const InlierSet& set);
  /// False, without effect, unless it is a usable fix of a known keyframe after that of the last
  /// fix, in the same absolute frame. Keyframe 0 is the origin of that frame and has no fix.
  bool add(const PositionFix& fix);
  /// True if there is no room for this closure: it is unknown, and kMaxClosures other closures to
  /// its peer are known.
  [[nodiscard]] bool is_full(const ClosureId& id) const;
  /// Discards everything about a restarted robot: its keyframe indices have a new meaning.
  void forget(RobotId peer);

  [[nodiscard]] int dimension() const { return dimension_; }
  [[nodiscard]] std::uint32_t keyframes() const { return keyframes_; }
  /// Increases with every change of the own keyframes and of the closures inside this robot.
  [[nodiscard]] std::uint32_t revision() const { return revision_; }

  /// Complete, nonempty edge sets, the newest first for each peer.
  [[nodiscard]] std::vector<EdgeSetOffer> offers() const;
  /// Edges of an offered set, ascending by id; nullptr if this robot does not (or no longer) hold
  /// it.
  [[nodiscard]] const std::vector<PoseEdge>* edges(RobotId peer, const EdgeSetId& id) const;
  /// Edges of the newest complete set with a peer, if there is one.
  [[nodiscard]] std::span<const PoseEdge> newest_edges(RobotId peer) const;

  /// The odometry of this robot and a peer by each known closure between them, selected or not.
  /// Ascending by closure.
  [[nodiscard]] std::span<const AlignedOdometry> alignments(RobotId peer) const;

  /// Estimates the noise of odometry again, from the closures inside this robot, and finds wrong
  /// steps if it `corrects` them. From now on, own_edges() has corrected steps and weights.
  void judge_odometry(bool corrects = true);
  /// Wrong steps by the last judge_odometry().
  [[nodiscard]] const std::vector<OdometryBreak>& odometry_breaks() const {
    return odometry_judgement_.breaks;
  }
  /// The last estimate; before the first one, odometry is as precise as it claims.
  [[nodiscard]] const OdometryNoise& odometry_noise() const { return odometry_judgement_.noise; }

  /// Odometry from each keyframe to the next, then closures inside this robot, ascending by id.
  [[nodiscard]] std::vector<PoseEdge> own_edges() const;
  /// Pose of keyframe 0 in the frame of odometry; the identity before there is one.
  [[nodiscard]] const SE3& T_odom_first() const { return T_odom_first_; }
  /// Priors of all keyframes with a vertical.
  [[nodiscard]] const std::vector<VerticalPrior>& verticals() const { return verticals_; }
  /// Ascending by keyframe.
  [[nodiscard]] const std::vector<PositionFix>& fixes() const { return fixes_; }
  /// True if keyframe 0 has a vertical: the frame of odometry then has z up.
  [[nodiscard]] bool upright() const { return !verticals_.empty() && verticals_[0].pose == 0; }
  /// Odometry step from keyframe i - 1 to i, as measured. Precondition: 0 < i < keyframes().
  [[nodiscard]] const SE3& step_to(std::uint32_t i) const { return odometry_[i - 1].T_from_to; }
  /// First keyframe of every run after the first one, ascending: see is_unknown_step().
  [[nodiscard]] const std::vector<KeyframeIndex>& later_runs() const { return later_runs_; }
  /// Closures inside this robot between keyframes before `run` and keyframes from `run` to before
  /// `end`, by the newest edge set.
  [[nodiscard]] std::vector<PoseEdge> closures_across(KeyframeIndex run, KeyframeIndex end) const;
  /// Weights of the mean variances of a step of odometry, corrected by odometry_noise(). Steps at
  /// rest with small variances hardly change them. Unknown steps do not count; the default weights
  /// while there are no others.
  [[nodiscard]] Precision mean_step_precision() const;

 private:
  struct EdgeSet {
    EdgeSetId id;
    std::vector<PoseEdge> edges;
  };
  // Edge sets with one peer, or inside this robot.
  struct Sets {
    InlierSet newest;               // closures ascending, each once
    bool changed = true;            // `complete` does not begin with `newest`
    std::vector<EdgeSet> complete;  // newest first
  };

  [[nodiscard]] RobotId peer_of(const ClosureId& id) const;
  void complete_sets();
  bool complete(Sets& sets, std::size_t kept) const;

  RobotId self_;
  int dimension_;
  SE3 T_odom_first_ = SE3::Identity();
  std::uint32_t keyframes_ = 0;
  std::uint32_t revision_ = 0;
  std::vector<PoseEdge> odometry_;  // with claimed precision
  std::vector<double> step_s_;      // duration of each step
  Stamp newest_ = 0;                // stamp of the last keyframe
  OdometryJudgement odometry_judgement_;
  std::vector<KeyframeIndex> later_runs_;
  std::vector<VerticalPrior> verticals_;
  std::vector<PositionFix> fixes_;
  std::map<ClosureId, PoseEdge> closures_;
  std::map<RobotId, std::size_t> closures_to_;  // number of `closures_` by peer
  std::map<RobotId, Sets> sets_;                // by peer; `self_`: inside this robot
  std::map<RobotId, std::vector<AlignedOdometry>> alignments_;  // by peer, without `self_`
};

}  // namespace km
