#pragma once

#include <map>
#include <set>
#include <utility>
#include <vector>

#include "modules/pose_graph/frame_alignment.hpp"
#include "modules/pose_graph/local_graph.hpp"
#include "modules/pose_graph/pgo_messages.hpp"
#include "modules/pose_graph/quadratic_problem.hpp"
#include "modules/pose_graph/truncated_newton.hpp"

namespace km {

/// Over-relaxation of the update that follows round `round`, see SessionBlock::update(): grows from
/// 1.5 to `max`. First the fast modes are damped, then the slow ones sped up.
[[nodiscard]] double growing_relaxation(std::uint32_t round, double max);

/// One robot's block of variables in a session: its own poses, the edges that touch them, and the
/// poses of its neighbours as last heard, which stay fixed while it updates its own.
class SessionBlock {
 public:
  /// `X` r x 4n feasible. `edges_to`: robots at the other ends, none of them empty.
  SessionBlock(LiftedPoses X, std::vector<BlockEdge> own_edges,
               const std::map<RobotId, std::vector<InterEdge>>& edges_to,
               std::vector<VerticalPrior> verticals = {});

  /// Takes a neighbour's poses. False, and no change, if it lacks a keyframe that an edge ends on.
  /// Robots that are not neighbours are accepted without effect.
  bool set_neighbour(RobotId robot, const std::vector<std::uint32_t>& keyframes,
                     const LiftedPoses& X);

  /// Brings the whole block into the frame of the neighbours heard so far, then solves it with the
  /// edges to them alone: the block bends on its first move already, since over a long odometry no
  /// rigid transform fits. It leaves the subspace of ordinary poses, see perturb_rotations().
  /// Precondition: at least one neighbour was set.
  void align(const AlignmentTolerance& tolerance, const TruncatedNewtonOptions& options);

  /// Lowers the cost of the block, all neighbours fixed, by minimise_beyond().
  /// Precondition: all neighbours were set.
  TruncatedNewtonResult update(const TruncatedNewtonOptions& options, double relaxation);

  /// Rounds the public poses to single precision, makes them feasible again, and returns them as
  /// rounded: what peers rebuild from them by restore_stiefel() is what stays here.
  [[nodiscard]] LiftedPoses round_public_poses();

  /// Cost of the own edges and of those to the robots in `counted`, at the present poses.
  [[nodiscard]] double share_of_cost(const std::set<RobotId>& counted) const;

  /// Keyframes that edges to other robots end on, and keyframe 0; ascending.
  [[nodiscard]] const std::vector<std::uint32_t>& public_keyframes() const { return public_; }
  [[nodiscard]] const LiftedPoses& X() const { return X_; }
  [[nodiscard]] std::set<RobotId> neighbours() const;
  /// Takes `X` for the present poses if it lowers the cost. Precondition: no neighbours.
  void offer(LiftedPoses X);
  /// Takes `X`, feasible, for the present poses.
  void move_to(LiftedPoses X) { X_ = std::move(X); }
  /// Of the Riemannian gradient of the block. Precondition: all neighbours were set.
  [[nodiscard]] double gradient_norm();
  /// The block's cost, neighbours as last heard.
  [[nodiscard]] const QuadraticProblem& problem();

 private:
  struct Slots {
    std::map<std::uint32_t, Eigen::Index> of_keyframe;
    bool set = false;
  };

  std::vector<PublicEdge> make_public_edges(
      const std::map<RobotId, std::vector<InterEdge>>& edges_to);
  [[nodiscard]] Eigen::MatrixXd align_rigidly(const std::vector<PublicEdge>& edges,
                                              const std::vector<SE3>& poses,
                                              const AlignmentTolerance& tolerance) const;

  LiftedPoses X_;
  std::map<RobotId, Slots> neighbours_;
  std::vector<RobotId> robot_of_edge_;  // of the k-th public edge
  std::vector<std::uint32_t> public_;
  QuadraticProblem problem_;
  LiftedPoses fixed_;
  bool fixed_changed_ = true;
};

}  // namespace km
