#pragma once

#include <Eigen/SparseCore>
#include <memory>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/rbcd/block_cholesky.hpp"
#include "modules/rbcd/stiefel.hpp"
#include "modules/tree_newton/chordal.hpp"
#include "modules/tree_newton/vertical_prior.hpp"

namespace km {

/// A relative pose between poses i and j of one block: poses that are solved together, e.g. those
/// of one robot. Its precisions are kappa of the rotation [1/rad^2], tau of the translation
/// [1/m^2].
struct BlockEdge {
  Eigen::Index i = 0;
  Eigen::Index j = 0;
  SE3 T_i_j = SE3::Identity();
  double kappa = 1.0;
  double tau = 1.0;

  [[nodiscard]] static BlockEdge of(const PoseEdge& e) {
    return {e.from.index, e.to.index, e.T_from_to, e.precision.kappa, e.precision.tau};
  }
  /// The edge if the block is that of robot 0.
  [[nodiscard]] PoseEdge of_one_robot() const {
    return {{0, static_cast<KeyframeIndex>(i)},
            {0, static_cast<KeyframeIndex>(j)},
            T_i_j,
            {kappa, tau}};
  }
};

/// Chordal initialisation of a block.
[[nodiscard]] std::vector<SE3> chordal_initialisation(Eigen::Index poses,
                                                      std::span<const BlockEdge> edges);

/// A relative pose between pose `own` of the block and pose `fixed` outside it. The cost of an edge
/// is not symmetric in its two ends, so the direction of the measurement is kept.
struct PublicEdge {
  Eigen::Index own = 0;
  Eigen::Index fixed = 0;
  bool from_own = true;     ///< T maps `fixed` to `own`; else `own` to `fixed`.
  SE3 T = SE3::Identity();  ///< T_own_fixed if from_own, else T_fixed_own.
  double kappa = 1.0;
  double tau = 1.0;
};

/// kappa ||Y_j - Y_i R||^2 + tau ||p_j - p_i - Y_i t||^2 for one edge; X_i, X_j are r x 4.
[[nodiscard]] double edge_cost(const Eigen::Ref<const Eigen::MatrixXd>& X_i,
                               const Eigen::Ref<const Eigen::MatrixXd>& X_j, const SE3& T_i_j,
                               double kappa, double tau);

/// The part of the pose graph cost that depends on one block of poses, with all other poses fixed:
///     f(X) = sum kappa ||Y_j - Y_i R_ij||_F^2 + tau ||p_j - p_i - Y_i t_ij||^2
/// over the edges inside the block and the edges to fixed poses, plus the costs of its vertical
/// priors, without a factor 1/2 (Tian et al., "Distributed Certifiably Correct Pose-Graph
/// Optimization", TRO 2021, Problem 2 and Eq. (14); = tr(X Q X^T) + 2 tr(X G^T) + const with Q
/// sparse 4n x 4n and G r x 4n). Not thread-safe.
class QuadraticProblem {
 public:
  /// Throws std::invalid_argument if an edge or a prior names a pose outside [0, poses), if a
  /// measurement is not finite, or if a precision is not positive and finite.
  QuadraticProblem(Eigen::Index rank, Eigen::Index poses, std::vector<BlockEdge> edges,
                   std::vector<PublicEdge> public_edges, std::vector<VerticalPrior> verticals = {});

  /// Sets the fixed poses, r x 4m. O(public edges); nothing is factorised.
  /// Throws std::invalid_argument if the shape does not cover the public edges.
  void set_fixed(LiftedPoses fixed);

  [[nodiscard]] double cost(const LiftedPoses& X) const;
  /// Cost of public edge `k` alone.
  [[nodiscard]] double public_edge_cost(std::size_t k, const LiftedPoses& X) const;
  /// 2 (X Q + G).
  [[nodiscard]] LiftedPoses euclidean_gradient(const LiftedPoses& X) const;
  /// Riemannian Hessian at `X` along tangent `V`: the projection of 2 V Q - V_Y sym(Y^T grad_Y),
  /// with the Euclidean `gradient` at X (Absil et al., "An Extrinsic Look at the Riemannian
  /// Hessian", 2013, for the Stiefel manifold).
  [[nodiscard]] LiftedPoses hessian_product(const LiftedPoses& X, const LiftedPoses& gradient,
                                            const LiftedPoses& V) const;
  /// (2 Q + a small diagonal)^-1 applied to `V` and projected to the tangent space. Q is factorised
  /// once, at the first call.
  [[nodiscard]] LiftedPoses precondition(const LiftedPoses& X, const LiftedPoses& V) const;

  [[nodiscard]] Eigen::Index rank() const { return rank_; }
  [[nodiscard]] Eigen::Index poses() const { return poses_; }
  [[nodiscard]] const std::vector<BlockEdge>& edges() const { return edges_; }
  [[nodiscard]] const std::vector<PublicEdge>& public_edges() const { return public_edges_; }
  [[nodiscard]] const std::vector<VerticalPrior>& verticals() const { return verticals_; }
  [[nodiscard]] const LiftedPoses& fixed() const { return fixed_; }
  /// Q, both triangles.
  [[nodiscard]] const Eigen::SparseMatrix<double>& data_matrix() const { return Q_; }
  /// Largest sums of kappa and of tau over the edges of one pose.
  [[nodiscard]] Eigen::Vector2d largest_degrees() const;

 private:
  void check() const;
  void build();
  void reset_linear_part();

  Eigen::Index rank_;
  Eigen::Index poses_;
  Eigen::Index fixed_count_ = 0;
  std::vector<BlockEdge> edges_;
  std::vector<PublicEdge> public_edges_;
  std::vector<VerticalPrior> verticals_;
  Eigen::SparseMatrix<double> Q_;  // 4n x 4n, symmetric, both triangles
  LiftedPoses fixed_;
  LiftedPoses G_;
  mutable std::unique_ptr<const BlockCholesky> preconditioner_;
};

}  // namespace km
