#pragma once

#include <map>
#include <optional>
#include <vector>

#include "modules/robust/member_edges.hpp"
#include "modules/robust/member_solver.hpp"

namespace km {

/// The part of one robot in a robust Newton method for the pose graph of a team, up and down a tree
/// of robots. README.md describes a round, and METHOD.md the weights.
///
/// A step is accepted once the next pass up has brought its cost to the root. If the cost has
/// risen, the step is shortened; while weights change, the cost may rise by half, twice in a row.
/// Only the root decides. Second derivatives hardly change (see edge_model.hpp), so old ones serve
/// several steps (Shamanskii's variant of Newton's method). The first ones are those of
/// Gauss-Newton, which cannot be indefinite.
class TreeNewton final : public MemberSolver {
 public:
  /// Throws std::invalid_argument if an edge is not usable or a public pose is missing.
  TreeNewton(SessionGraph graph, TreePlace place, const TreeNewtonOptions& options);

  bool receive(RobotId from, std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] bool ready() const override;
  [[nodiscard]] std::vector<SolverMessage> advance() override;
  [[nodiscard]] bool done() const override { return phase_ == Phase::kDone; }
  [[nodiscard]] const std::vector<SE3>& poses() const override { return accepted_; }
  [[nodiscard]] std::vector<Matrix6> covariances() const override { return covariances_; }
  [[nodiscard]] SolverState state() const override { return state_; }
  [[nodiscard]] ClosureVerdicts verdicts() const override;
  [[nodiscard]] ClosureNoiseRecord noise() const override { return edges_.graph().noise; }

 private:
  enum class Phase { kUp, kDown, kDone };

  [[nodiscard]] std::vector<SolverMessage> go_up();
  [[nodiscard]] UpMessage equations();
  [[nodiscard]] bool can_follow(const DownMessage& message) const;
  [[nodiscard]] std::vector<SolverMessage> go_down(const DownMessage& message);
  void build_front();
  void return_to_start();
  void take_step(const Eigen::VectorXd& step, std::map<RobotId, Eigen::VectorXd>& children);
  void move(double scale);
  void accept();
  void finish();
  void doubt(const TreeInverse& from_parent);
  void compute_covariances(const TreeInverse& from_parent);

  TreeNewtonOptions options_;
  TreePlace place_;
  MemberEdges edges_;
  std::optional<TreeFront> front_;
  std::optional<EdgeWeights> weights_;  // weights of the first edges of the front
  std::optional<TreeRoot> root_;

  Phase phase_ = Phase::kUp;
  std::uint32_t round_ = 0;
  std::map<RobotId, UpMessage> ups_;  // messages of the children in this round
  Eigen::Index sent_rows_ = 0;        // rows of the message up in this round
  std::optional<DownMessage> down_;
  TreeVerdict verdict_;        // last decision of the root
  std::vector<SE3> accepted_;  // own poses
  std::vector<SE3> base_;      // accepted followed poses
  std::vector<SE3> present_;   // followed poses after the step
  Eigen::MatrixXd step_;       // step of the followed poses
  bool refresh_ = true;
  bool factorised_ = true;
  SolverState state_;
  std::map<RobotId, TreeInverse> inverse_of_child_;
  std::vector<Matrix6> covariances_;
};

}  // namespace km
