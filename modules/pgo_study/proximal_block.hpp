#pragma once

#include "modules/pgo_study/descent_block.hpp"

namespace km {

/// A robot's block that may move at the same time as its neighbours, and on poses of theirs that
/// are out of date. An update minimises, from the present poses X',
///     f(X; neighbours as heard) + weight * sum_e ||E_e (X - X')||^2 ,
/// where E_e (X - X') is by how much the residual of inter-robot edge e changes, times the roots of
/// its precisions. Both terms of an edge are squares of residuals that are linear in the poses at
/// its two ends, so they are one: that of the edge with 1 + weight times its precision, and for a
/// neighbour the mean of what was heard and where this block's own poses would put it. Thus the
/// step is limited where the block meets others, in the metric of the edges there, and nowhere
/// else; and Q stays constant. Not thread-safe.
class ProximalBlock {
 public:
  /// See DescentBlock; without verticals. Throws std::invalid_argument if `weight` is negative or
  /// not finite.
  ProximalBlock(const SessionGraph& part, LiftedPoses X, double weight);

  /// Lowers the sum above by minimise_beyond(): it never rises.
  /// Precondition: all neighbours of block() were set.
  TruncatedNewtonResult update(const TruncatedNewtonOptions& options, double relaxation);

  /// Poses, neighbours, and what is told to them.
  [[nodiscard]] DescentBlock& block() { return block_; }
  [[nodiscard]] const DescentBlock& block() const { return block_; }

 private:
  DescentBlock block_;
  double weight_;
  QuadraticProblem problem_;
};

}  // namespace km
