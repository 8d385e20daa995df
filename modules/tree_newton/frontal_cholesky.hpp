#pragma once

#include <memory>
#include <vector>

#include "modules/tree_newton/elimination_plan.hpp"

namespace km {

/// Cholesky factorisation of a symmetric block matrix A by its elimination plan, and the Schur
/// complement onto the kept nodes. forward() reduces a right-hand side to the kept nodes.
/// backward() computes the solution of all nodes from the solution of the kept ones. Both need only
/// the factor, so that robots can solve A X = C together, each with some of the nodes. Not
/// thread-safe.
class FrontalCholesky {
 public:
  explicit FrontalCholesky(std::shared_ptr<const EliminationPlan> plan) : plan_(std::move(plan)) {}

  /// Factorises A, which has the plan's nodes and pairs. False if it is not positive definite on
  /// the nodes to eliminate; nothing else may be called then.
  [[nodiscard]] bool factorise(const BlockMatrix& A);

  /// Schur complement of the last A onto the kept nodes, in the order of the plan's kept() and
  /// kept_pairs().
  [[nodiscard]] const BlockMatrix& schur() const { return schur_; }

  /// Forward substitution of the right-hand side C, (B nodes) x k, in place. Rows of eliminated
  /// nodes become the input of backward(); rows of kept nodes become the right-hand side of the
  /// Schur complement.
  void forward(Eigen::MatrixXd& C) const;
  /// Back substitution in place: `X` is the output of forward() with the solution in the rows of
  /// the kept nodes, and becomes the full solution.
  void backward(Eigen::MatrixXd& X) const;

  /// Blocks of the inverse of A at all nodes and pairs of the plan (selected inversion: Takahashi,
  /// Fagan, Chin, PICA 1973). `kept` has these blocks at the kept nodes, in the order of schur().
  [[nodiscard]] BlockMatrix selected_inverse(const BlockMatrix& kept) const;

 private:
  bool factorise_front(std::size_t f, const BlockMatrix& A);
  void add_to_schur(const EliminationPlan::Front& front, const Eigen::MatrixXd& rest);
  void add_kept(const BlockMatrix& A);
  void invert_pivots(const Eigen::MatrixXd& factor, Eigen::MatrixXd& Z) const;
  [[nodiscard]] Eigen::MatrixXd inverse_of_rest(const std::vector<int>& place,
                                                const Eigen::MatrixXd& of_parent,
                                                const BlockMatrix& kept) const;
  void add_front(const EliminationPlan::Front& front, const Eigen::MatrixXd& Z,
                 const std::vector<int>& local, BlockMatrix& inverse) const;
  void place_kept(const BlockMatrix& kept, BlockMatrix& inverse) const;

  std::shared_ptr<const EliminationPlan> plan_;
  Eigen::Index block_ = 0;
  std::vector<Eigen::MatrixXd> factors_;  // per front: columns of L of its pivots
  std::vector<Eigen::MatrixXd> rests_;  // Schur complement per front, until its parent has added it
  std::vector<int> local_;              // place of each node in the present front
  BlockMatrix schur_;
};

}  // namespace km
