#pragma once

#include <memory>
#include <vector>

#include "modules/pose_graph/elimination_plan.hpp"

namespace km {

/// Cholesky factorisation of a symmetric block matrix A by its elimination plan, and the Schur
/// complement onto the nodes that are kept. With nothing but the factor, forward() reduces a
/// right-hand side to the kept nodes and backward() goes from their solution to all nodes', so that
/// A X = C is solved by parties who each hold some of the nodes. Not thread-safe.
class FrontalCholesky {
 public:
  explicit FrontalCholesky(std::shared_ptr<const EliminationPlan> plan) : plan_(std::move(plan)) {}

  /// Factorises A, which has the plan's nodes and pairs. False if it is not positive definite on
  /// the nodes to eliminate; nothing else may be called then.
  [[nodiscard]] bool factorise(const BlockMatrix& A);

  /// Schur complement of the last A onto the kept nodes, in the order of the plan's kept() and
  /// kept_pairs().
  [[nodiscard]] const BlockMatrix& schur() const { return schur_; }

  /// Right-hand side C, (B nodes) x k, in place: of the eliminated nodes to what backward() needs,
  /// of the kept ones to that of the Schur complement's system.
  void forward(Eigen::MatrixXd& C) const;
  /// From forward()'s output with the kept nodes' rows replaced by their solution, to the solution.
  void backward(Eigen::MatrixXd& X) const;

  /// | |L|^T b |^2 for b >= 0 of B nodes entries, L being the factor's columns of the eliminated
  /// nodes: what its rounding errors are bounded by.
  [[nodiscard]] double magnitude(const Eigen::VectorXd& b) const;

  [[nodiscard]] const EliminationPlan& plan() const { return *plan_; }

 private:
  bool factorise_front(std::size_t f, const BlockMatrix& A);
  void add_to_schur(const EliminationPlan::Front& front, const Eigen::MatrixXd& rest);
  void add_kept(const BlockMatrix& A);
  [[nodiscard]] int kept_pair(int a, int b) const;

  std::shared_ptr<const EliminationPlan> plan_;
  Eigen::Index block_ = 0;
  std::vector<Eigen::MatrixXd> factors_;  // per front: its pivots' columns of L
  std::vector<Eigen::MatrixXd> rests_;    // per front, until its parent has taken it in
  std::vector<int> local_;                // of each node in the front at hand
  BlockMatrix schur_;
};

}  // namespace km
