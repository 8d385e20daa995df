#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/bytes.hpp"
#include "modules/pose_graph/member_solver.hpp"
#include "modules/pose_graph/quadratic_problem.hpp"
#include "modules/pose_graph/session_graph.hpp"

namespace km {

/// The same on all members of a session.
struct RbcdOptions {
  Eigen::Index rank = 5;                ///< Of the relaxation.
  std::uint32_t max_rounds = 0;         ///< 0: no limit.
  double min_relative_decrease = 1e-7;  ///< Of the team's cost in a round: less is convergence.
  int max_newton_steps = 3;             ///< Of one block update.
  int max_cg_iterations = 50;           ///< Of one Newton step.
  double max_over_relaxation = 1.95;    ///< 1: to the minimum of the block, see minimise_beyond().
};

/// Riemannian block-coordinate descent on the rank relaxation (Tian et al., "Distributed
/// Certifiably Correct Pose-Graph Optimization", TRO 2021, Alg. 3), the blocks in turn.
///
/// In a round every member lowers the cost of its own lifted poses, all others fixed, once those of
/// its neighbours in the graph of closures that come before it in the order of ids have done so: a
/// Gauss-Seidel sweep. Of two neighbours only one is free to move at any time, so the team's cost
/// never rises but by what rounding to single precision costs. A neighbour is told the poses that
/// closures to it end on; the root of the tree is told every member's share of cost and gradient,
/// and tells all now and then which round they have got to, at the end which round counts. The
/// tree is not used otherwise. Every member comes by each of the rounds told, one at a time, so
/// that all of them can go back to one that all have completed.
///
/// The relaxation lives in here alone. It begins at the start lifted and moved off the rigid poses
/// a little (perturb_rotations()), which everyone knows of everyone's public poses: the first round
/// needs no exchange before it. Rigid poses are rounded in the frame of the root's first pose,
/// which stays where it was; where poses of absent robots or verticals hold the frame, in theirs.
class MemberRbcd final : public MemberSolver {
 public:
  /// Throws std::invalid_argument if the graph is not usable, see QuadraticProblem, if a pose at
  /// the other end of a closure was not told, or for a rank below 3.
  MemberRbcd(SessionGraph graph, const TreePlace& place, const RbcdOptions& options);

  bool receive(RobotId from, std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] bool ready() const override;
  [[nodiscard]] std::vector<SolverLetter> advance() override;
  [[nodiscard]] bool done() const override { return done_; }

  [[nodiscard]] const std::vector<SE3>& poses() const override { return poses_; }
  /// Of the relaxation, at the round that poses() are of.
  [[nodiscard]] SolverState state() const override { return state_; }
  [[nodiscard]] ClosureVerdicts verdicts() const override { return {}; }

 private:
  // Of the robots that closures lead to, absent ones included.
  struct Neighbour {
    std::map<KeyframeIndex, Eigen::Index> slot_of;  // in fixed_
    std::vector<KeyframeIndex> own;                 // told to it, ascending
    std::uint32_t round = 0;
    bool absent = false;
    bool before = false;  // in the order of updates
  };
  struct Share {
    double cost = 0.0;
    double squared_gradient = 0.0;
    bool held = false;  // by absent robots' poses
  };
  struct Total {
    double cost = 0.0;
    double gradient = 0.0;
  };
  struct RoundTotal {
    std::uint32_t round = 0;
    Total total;
  };
  // What the root tells all, each upon the one before.
  struct Progress {
    RoundTotal at;
    std::uint32_t before = 0;  // the round told last
    bool stop = false;
    Eigen::MatrixXd anchor;  // r x 4: the session's frame, lifted
  };

  [[nodiscard]] QuadraticProblem make_problem();
  [[nodiscard]] LiftedPoses lifted_start() const;
  [[nodiscard]] bool is_root() const { return !place_.parent; }
  [[nodiscard]] bool is_member(RobotId robot) const;
  [[nodiscard]] bool can_update() const;
  [[nodiscard]] bool round_is_complete() const;

  void update(std::vector<SolverLetter>& letters);
  std::map<KeyframeIndex, Eigen::MatrixXf> round_public_poses();
  void report_share(double squared_gradient, std::vector<SolverLetter>& letters);
  [[nodiscard]] bool close_round(std::vector<SolverLetter>& letters);
  void tell(const RoundTotal& at, bool stop, std::vector<SolverLetter>& letters);
  [[nodiscard]] Eigen::MatrixXd anchor_at(std::uint32_t round) const;
  void adopt(const Progress& progress);

  bool take_poses(RobotId from, std::uint32_t round, ByteReader& reader);
  bool take_share(RobotId from, std::uint32_t round, ByteReader& reader);
  bool take_progress(RobotId from, std::uint32_t round, ByteReader& reader);

  SessionGraph graph_;
  TreePlace place_;
  RbcdOptions options_;
  std::map<RobotId, Neighbour> neighbours_;
  std::vector<RobotId> robot_of_edge_;  // of the k-th public edge of problem_
  LiftedPoses fixed_;
  QuadraticProblem problem_;
  std::map<std::uint32_t, LiftedPoses> history_;  // by round, from the last one told on
  std::map<std::uint32_t, Progress> heard_;       // not adopted yet, by the round before
  bool started_ = false;
  bool done_ = false;
  std::vector<SE3> poses_;
  SolverState state_;

  // Of the root.
  std::map<std::uint32_t, std::map<RobotId, Share>> shares_;  // of rounds that are not complete
  std::optional<RoundTotal> last_;                            // complete
  Total start_;
  bool held_ = false;
};

}  // namespace km
