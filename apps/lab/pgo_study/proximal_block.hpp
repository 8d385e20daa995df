#pragma once

#include "apps/lab/pgo_study/block_border.hpp"
#include "apps/lab/pgo_study/sent_poses.hpp"
#include "modules/rbcd/truncated_newton.hpp"

namespace km {

/// One robot's block of variables: its own poses, the edges that touch them, and the newest
/// received poses of its neighbours. The block may move at the same time as its neighbours, and on
/// outdated poses of them. An update minimises, from the current poses X',
///     f(X; neighbours as received) + weight * sum_e ||E_e (X - X')||^2 ,
/// and E_e (X - X') is the change of the residual of inter-robot edge e, times the roots of its
/// precisions. Both terms of an edge are squares of residuals that are linear in the poses at its
/// two ends. Their sum is therefore one such term, with 1 + weight times the precision of the edge.
/// Its target is the weighted mean of the received pose and the pose that follows from X' through
/// the edge. The step is thus limited only at the inter-robot edges, in their metric, and Q stays
/// constant. Not thread-safe.
class ProximalBlock {
 public:
  /// `part`: result of part_of(), without verticals. `X`: r x 4n, feasible. Throws
  /// std::invalid_argument if `weight` is negative or not finite.
  ProximalBlock(const SessionGraph& part, LiftedPoses X, double weight);

  /// Stores the feasible poses of a neighbour. False, without a change, if a keyframe is missing on
  /// which an edge ends. Poses of robots that are not neighbours have no effect.
  bool set_neighbour(RobotId robot, const SentPoses& sent);

  /// Minimises the sum above by minimise_over_relaxed(). The sum never rises. Precondition: poses
  /// of all neighbours are set.
  TruncatedNewtonResult update(const TruncatedNewtonOptions& options, double relaxation);

  /// Rounds the public poses to single precision, makes them feasible again, stores and returns
  /// them. Neighbours thus receive exactly the poses that this block uses.
  [[nodiscard]] SentPoses round_public_poses();

  [[nodiscard]] const LiftedPoses& X() const { return X_; }

 private:
  LiftedPoses X_;
  BlockBorder border_;
  double weight_;
  QuadraticProblem problem_;
  LiftedPoses received_;
};

}  // namespace km
