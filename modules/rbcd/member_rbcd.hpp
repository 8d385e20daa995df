#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/io/bytes.hpp"
#include "modules/rbcd/quadratic_problem.hpp"
#include "modules/robust/member_solver.hpp"
#include "modules/robust/session_graph.hpp"

namespace km {

/// Parameters of block descent, equal on all members of a session.
struct RbcdOptions {
  Eigen::Index rank = 5;         ///< Rank r of the relaxation.
  std::uint32_t max_rounds = 0;  ///< 0: no limit.
  /// The session ends when a round decreases the team cost by less, relative to the cost.
  double min_relative_decrease = 1e-7;
  double max_over_relaxation = 1.95;  ///< 1: no over-relaxation, see minimise_over_relaxed().
};

/// Riemannian block-coordinate descent on the rank relaxation (Tian et al., "Distributed
/// Certifiably Correct Pose-Graph Optimization", TRO 2021, Alg. 3). The blocks take turns.
///
/// In a round every member lowers the cost of its own lifted poses, with all other poses fixed. It
/// waits for those neighbours in the graph of closures that have a lower id: a Gauss-Seidel sweep.
/// Only one of two neighbours may move at any time, so the team cost rises by no more than rounding
/// to single precision. A member sends each neighbour the poses on which closures to it end. It
/// sends its share of cost and gradient to the root of the tree. Every five rounds the root sends
/// the number of a complete round to all members, and at the end the number of the final round. The
/// tree has no other use. poses() are those of the last reported round. Every member adopts all
/// reported rounds in order. If a session is interrupted, all members can thus return to a round
/// that all have completed.
///
/// Only this class knows the relaxation. The descent begins at the lifted start, perturbed slightly
/// away from rigid poses (perturb_rotations()). Every robot computes the same perturbation of the
/// public poses, so the first round needs no exchange before it. Lifted poses are rounded to rigid
/// poses in the frame in which the first pose of the root keeps its start. With verticals, the
/// poses are also rotated so that z is up. If poses of absent robots fix the frame, the poses are
/// rounded in that frame.
class MemberRbcd final : public MemberSolver {
 public:
  /// Throws std::invalid_argument if the graph is not usable, see QuadraticProblem, if the pose at
  /// the other end of a closure is missing, or for a rank below 3.
  MemberRbcd(SessionGraph graph, const TreePlace& place, const RbcdOptions& options);

  bool receive(RobotId from, std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] bool ready() const override;
  [[nodiscard]] std::vector<SolverMessage> advance() override;
  [[nodiscard]] bool done() const override { return done_; }

  [[nodiscard]] const std::vector<SE3>& poses() const override { return poses_; }
  /// State of the relaxation at the round of poses().
  [[nodiscard]] SolverState state() const override { return state_; }
  [[nodiscard]] ClosureVerdicts verdicts() const override { return {}; }

 private:
  // A robot with closures to this one: a member of the session, or a robot out of reach.
  struct Neighbour {
    std::map<KeyframeIndex, Eigen::Index> slot_of;  // places in fixed_
    std::vector<KeyframeIndex> own;                 // poses sent to it, ascending
    std::uint32_t round = 0;
    bool absent = false;          // out of reach: its poses are held
    bool updates_before = false;  // it updates before this robot
  };
  struct Share {
    double cost = 0.0;
    double squared_gradient = 0.0;
    bool held = false;  // poses of absent robots fix the frame
  };
  struct Total {
    double cost = 0.0;
    double gradient = 0.0;
  };
  struct RoundTotal {
    std::uint32_t round = 0;
    Total total;
  };
  // Message of the root to all members; each one refers to the message before it.
  struct Progress {
    RoundTotal at;
    std::uint32_t before = 0;  // round of the message before
    bool stop = false;
    Eigen::MatrixXd anchor;  // r x 4: frame of the session, lifted
  };

  [[nodiscard]] QuadraticProblem make_problem();
  [[nodiscard]] LiftedPoses lifted_start() const;
  [[nodiscard]] bool is_root() const { return !place_.parent; }
  [[nodiscard]] bool is_member(RobotId robot) const;
  [[nodiscard]] bool can_update() const;
  [[nodiscard]] bool round_is_complete() const;

  void update(std::vector<SolverMessage>& messages);
  std::map<KeyframeIndex, Eigen::MatrixXf> round_public_poses();
  void report_share(double squared_gradient, std::vector<SolverMessage>& messages);
  [[nodiscard]] bool close_round(std::vector<SolverMessage>& messages);
  void report_progress(const RoundTotal& at, bool stop, std::vector<SolverMessage>& messages);
  [[nodiscard]] Eigen::MatrixXd anchor_at(std::uint32_t round) const;
  void adopt(const Progress& progress);

  bool take_poses(RobotId from, std::uint32_t round, ByteReader& reader);
  bool take_share(RobotId from, std::uint32_t round, ByteReader& reader);
  bool take_progress(RobotId from, std::uint32_t round, ByteReader& reader);

  SessionGraph graph_;
  TreePlace place_;
  RbcdOptions options_;
  std::map<RobotId, Neighbour> neighbours_;
  std::vector<RobotId> robot_of_edge_;  // [k]: other robot of public edge k of problem_
  LiftedPoses fixed_;
  QuadraticProblem problem_;
  std::map<std::uint32_t, LiftedPoses> history_;  // by round, since last Progress
  std::map<std::uint32_t, Progress> pending_;     // not adopted; by the round of the message before
  bool started_ = false;
  bool done_ = false;
  std::vector<SE3> poses_;
  SolverState state_;

  // Only the root uses the variables from here on.
  std::map<std::uint32_t, std::map<RobotId, Share>> shares_;  // shares of incomplete rounds
  std::optional<RoundTotal> last_;                            // last complete round
  Total start_;
  bool held_ = false;
};

}  // namespace km
