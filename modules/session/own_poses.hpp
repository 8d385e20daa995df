#pragma once

#include <utility>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/session/own_graph.hpp"

namespace km {

/// The start of robot `self` in a session, by its own measurements alone: odometry with its wrong
/// steps corrected, in the frame of odometry. Every later run (OwnGraph::later_runs()) is moved to
/// where most of its closures to the runs before it agree. The chordal initialisation replaces the
/// poses if its cost is lower. If closures are `trusted`, all of them count. Otherwise, the
/// initialisation contains closures that are likely true, and the cost of a closure is truncated.
/// Precondition: there is a keyframe.
[[nodiscard]] std::vector<SE3> own_start(const OwnGraph& graph, RobotId self, bool trusted);

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
  /// poses, the first keyframe has its odometry pose. New runs are placed as in own_start(); a run
  /// stays if most of its closures agree with its place already.
  void extend(const OwnGraph& graph, RobotId self);

 private:
  std::vector<SE3> T_frame_kf_, restored_;
  std::vector<Matrix6> covariances_;
};

}  // namespace km
