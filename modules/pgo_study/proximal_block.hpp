#pragma once

#include "modules/pgo_study/block_edges.hpp"
#include "modules/pgo_study/told_block.hpp"
#include "modules/pose_graph/truncated_newton.hpp"

namespace km {

/// One robot's block of variables: its own poses, the edges that touch them, and the poses of its
/// neighbours as last heard. The block may move at the same time as its neighbours, and on poses of
/// theirs that are out of date. An update minimises, from the present poses X',
///     f(X; neighbours as heard) + weight * sum_e ||E_e (X - X')||^2 ,
/// where E_e (X - X') is by how much the residual of inter-robot edge e changes, times the roots of
/// its precisions. Both terms of an edge are squares of residuals that are linear in the poses at
/// its two ends, so they are one: that of the edge with 1 + weight times its precision, and for a
/// neighbour the mean of what was heard and where this block's own poses would put it. Thus the
/// step is limited where the block meets others, in the metric of the edges there, and nowhere
/// else; and Q stays constant. Not thread-safe.
class ProximalBlock {
 public:
  /// `part` as part_of() gives it, without verticals; `X` r x 4n feasible. Throws
  /// std::invalid_argument if `weight` is negative or not finite.
  ProximalBlock(const SessionGraph& part, LiftedPoses X, double weight);

  /// Takes a neighbour's poses, feasible. False, and no change, if a keyframe is missing that an
  /// edge ends on. Robots that are not neighbours are accepted without effect.
  bool set_neighbour(RobotId robot, const ToldBlock& told);

  /// Lowers the sum above by minimise_beyond(): it never rises.
  /// Precondition: all neighbours were set.
  TruncatedNewtonResult update(const TruncatedNewtonOptions& options, double relaxation);

  /// Rounds the public poses to single precision, makes them feasible again, and returns them so:
  /// the poses that neighbours hear are those that stay here.
  [[nodiscard]] ToldBlock round_public_poses();

  [[nodiscard]] const LiftedPoses& X() const { return X_; }

 private:
  LiftedPoses X_;
  BlockBorder border_;
  double weight_;
  QuadraticProblem problem_;
  LiftedPoses heard_;
};

}  // namespace km
