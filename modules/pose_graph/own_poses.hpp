#pragma once

#include <cstddef>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/pose_graph/frame_alignment.hpp"
#include "modules/pose_graph/own_graph.hpp"

namespace km {

/// The poses of the keyframes of one robot between sessions: the poses of the last session, and
/// odometry for later keyframes. Not thread-safe.
class OwnPoses {
 public:
  /// In the frame of the last session.
  [[nodiscard]] const std::vector<SE3>& T_frame_kf() const { return T_frame_kf_; }
  /// Covariances of the first keyframes, by the solution that set the poses; empty: unknown.
  [[nodiscard]] const std::vector<Matrix6>& covariances() const { return covariances_; }
  void set(std::vector<SE3> T_frame_kf, std::vector<Matrix6> covariances = {}) {
    T_frame_kf_ = std::move(T_frame_kf);
    covariances_ = std::move(covariances);
  }
  /// Poses of a former process for the first keyframes.
  void restore(std::vector<SE3> T_frame_kf) { restored_ = std::move(T_frame_kf); }

  /// Adds new keyframes: restored ones with their poses, the others by odometry. Without restored
  /// poses, the first keyframe has its odometry pose.
  void extend(const OwnGraph& graph);

  /// Moves the poses after each wrong step of odometry as a whole, such that the step is corrected.
  /// Each step is corrected only once.
  void correct(std::span<const OdometryBreak> breaks);

  /// Moves every later run (OwnGraph::later_runs()) as a whole to where most of its closures to the
  /// runs before it agree. A run stays if most of them agree with its place already.
  /// Precondition: extend().
  void place_runs(const OwnGraph& graph, RobotId self);

  /// Moves keyframe 0, the origin of an absolute frame.
  void place_first(const SE3& T_frame_first) {
    T_frame_kf_.front() = T_frame_first;
    covariances_.clear();
  }

  /// Improves the start of a session of this robot alone: the chordal initialisation replaces the
  /// poses if its cost is lower. If closures are `trusted`, all of them count. Otherwise, the
  /// initialisation contains closures that are likely true, and the cost of a closure is truncated.
  /// Precondition: extend(). Does nothing if the number of closures is that of the last call.
  void improve_alone(const OwnGraph& graph, RobotId self, bool trusted);

 private:
  [[nodiscard]] std::vector<PoseEdge> likely_closures(const OwnGraph& graph, RobotId self,
                                                      std::span<const PoseEdge> inside) const;

  std::vector<SE3> T_frame_kf_, restored_;
  std::vector<Matrix6> covariances_;
  std::set<std::size_t> corrected_;  // steps
  std::size_t improved_with_ = 0;    // number of closures
};

}  // namespace km
