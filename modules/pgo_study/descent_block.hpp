#pragma once

#include <algorithm>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "modules/pgo_study/block_edges.hpp"
#include "modules/pose_graph/truncated_newton.hpp"

namespace km {

/// Over-relaxation of the update that follows round `round`, see DescentBlock::update(): grows from
/// 1.5 to `max`. First the fast modes are damped, then the slow ones sped up.
[[nodiscard]] inline double growing_relaxation(std::uint32_t round, double max) {
  return std::min(max, 2.0 - 4.0 / (8.0 + round));
}

/// Poses of one robot that it tells the others.
struct ToldBlock {
  std::vector<KeyframeIndex> keyframes = {};  ///< Ascending.
  LiftedPoses X = {};                         ///< r x 4 per keyframe.
};

/// One robot's block of variables in block-coordinate descent: its own poses, the edges that touch
/// them, and the poses of its neighbours as last heard, which stay fixed while it updates its own.
class DescentBlock {
 public:
  /// `part` as part_of() gives it; `X` r x 4n feasible.
  DescentBlock(const SessionGraph& part, LiftedPoses X);

  /// Takes a neighbour's poses, feasible. False, and no change, if a keyframe is missing that an
  /// edge ends on. Robots that are not neighbours are accepted without effect.
  bool set_neighbour(RobotId robot, const ToldBlock& told);

  /// Lowers the cost of the block, all neighbours fixed, by minimise_beyond().
  /// Precondition: all neighbours were set.
  TruncatedNewtonResult update(const TruncatedNewtonOptions& options, double relaxation);

  /// Rounds the public poses to single precision, makes them feasible again, and returns them so:
  /// what neighbours hear is what stays here.
  [[nodiscard]] ToldBlock round_public_poses();

  /// Cost of the own edges and of those to the robots in `counted`, at the present poses.
  [[nodiscard]] double share_of_cost(const std::set<RobotId>& counted) const;

  /// Keyframes that edges to other robots end on, ascending.
  [[nodiscard]] const std::vector<KeyframeIndex>& public_keyframes() const { return border_.own; }
  [[nodiscard]] const LiftedPoses& X() const { return X_; }
  /// Takes `X`, feasible, for the present poses.
  void move_to(LiftedPoses X) { X_ = std::move(X); }
  /// Of the Riemannian gradient of the block. Precondition: all neighbours were set.
  [[nodiscard]] double gradient_norm();
  /// The block's cost, neighbours as last heard.
  [[nodiscard]] const QuadraticProblem& problem();

 private:
  LiftedPoses X_;
  BlockBorder border_;
  QuadraticProblem problem_;
  LiftedPoses fixed_;
  bool fixed_changed_ = true;
};

/// Rounds the poses `keyframes` of `X` to single precision, makes them feasible again, and returns
/// them.
[[nodiscard]] LiftedPoses round_poses(LiftedPoses& X, const std::vector<KeyframeIndex>& keyframes);

}  // namespace km
