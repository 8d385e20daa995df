#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "modules/pose_graph/newton/edge_model.hpp"
#include "modules/pose_graph/newton/frontal_cholesky.hpp"
#include "modules/pose_graph/robust/public_graph.hpp"

namespace km {

/// Newton's equations of a team on its public poses, as every robot assembles and solves them for
/// itself: what the robots tell of their own parts, eliminated onto their public poses, and the
/// edges between robots, weighted, of which everyone knows all. One pose, in the middle, is held.
///
/// Random false edges couple everything with everything, and a factorisation would fill up. So if
/// there are many that no other edge runs beside, those are left out of it, and it preconditions
/// conjugate gradients on the whole. Not thread-safe.
class PublicSystem {
 public:
  struct Solution {
    Eigen::MatrixXd x;       ///< B x nodes.
    double decrement = 0.0;  ///< C^T A^-1 C.
    int iterations = 0;      ///< Of conjugate gradients; 0: solved directly.
  };

  PublicSystem(std::shared_ptr<const PublicGraph> graph, int dimension);

  /// Takes in the Schur complement of a robot's part. Throws std::invalid_argument if its size is
  /// not that of the pattern told.
  void set_part(RobotId robot, const BlockMatrix& schur);

  /// Linearises the links at `poses` of the nodes and factorises. Full second derivatives of the
  /// links that turn out indefinite give way to Gauss-Newton's. False if it is indefinite even so:
  /// the robots' parts are, or the links with a weight above zero do not join all robots. Nothing
  /// may be solved then.
  [[nodiscard]] bool factorise(std::span<const SE3> poses, std::span<const double> weights,
                               Curvature curvature);

  /// `reduced`: right-hand sides of the robots' parts, B nodes. Conjugate gradients end once the
  /// residual, as the preconditioner measures it, has fallen by `accuracy`.
  [[nodiscard]] Solution solve(const Eigen::VectorXd& reduced, double accuracy) const;

 private:
  /// A link outside the factorisation.
  struct Loose {
    Eigen::Index i = 0;
    Eigen::Index j = 0;
    Eigen::MatrixXd H_ii;
    Eigen::MatrixXd H_ij;
    Eigen::MatrixXd H_jj;
  };

  [[nodiscard]] std::shared_ptr<const EliminationPlan> make_plan();
  [[nodiscard]] bool try_factorise(std::span<const SE3> poses, std::span<const double> weights,
                                   Curvature curvature);
  void add_parts();
  void add_link(std::size_t k, const EdgeModel& model);
  [[nodiscard]] Eigen::VectorXd product(const Eigen::VectorXd& x) const;
  [[nodiscard]] Eigen::VectorXd precondition(Eigen::VectorXd r) const;
  [[nodiscard]] Solution refine(const Eigen::VectorXd& C, double accuracy) const;

  std::shared_ptr<const PublicGraph> graph_;
  int dimension_;
  Eigen::Index block_;
  std::vector<bool> loose_;  // per link
  std::vector<int> pair_of_link_;
  std::map<RobotId, std::vector<int>> pairs_of_part_;
  std::shared_ptr<const EliminationPlan> plan_;
  FrontalCholesky factor_;
  std::map<RobotId, BlockMatrix> parts_;
  BlockMatrix sum_;                 // of all but the loose links
  std::vector<Loose> loose_links_;  // those with a weight
  Eigen::VectorXd slope_;           // of the links: minus the gradient
};

}  // namespace km
