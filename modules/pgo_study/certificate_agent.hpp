#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "modules/pgo_study/block_edges.hpp"
#include "modules/pose_graph/block_cholesky.hpp"

namespace km {

/// What all robots conclude alike from a sum over the team.
struct [[nodiscard]] CertificateState {
  double lambda = 0.0;    ///< Least Rayleigh quotient so far: an upper bound of the eigenvalue.
  double residual = 0.0;  ///< Of the vector before, over the mean sum of kappa at a pose.
  int iterations = 0;
};

/// One robot's part of a distributed search for the smallest eigenvalue of the certificate matrix
/// S = Q - Lambda (see certificate.hpp) beyond its kernel, which at a critical point X holds the
/// rows of X and the common translation: by LOBPCG (Knyazev, "Toward the Optimal Preconditioned
/// Eigensolver", SIAM J. Sci. Comput. 2001) for one vector, preconditioned by a factorisation of
/// the robot's own diagonal block of S. Vectors are 1 x 4n, in the inner product with weight 1 on
/// rotations and kTranslationWeight on translations [1/m^2]: the sign of the least eigenvalue does
/// not depend on it.
///
/// What crosses the network: rows of public poses (of X first, then of one vector per iteration),
/// and one sum over the team in each iteration. Every robot then takes the same step.
/// A negative quotient proves that X is no global minimum; a positive one that has converged shows,
/// from a random start, that almost surely none is there: the proof is certify()'s.
class CertificateAgent {
 public:
  static constexpr double kTranslationWeight = 1e-6;

  /// `part` as part_of() gives it; `X` its block, r x 4n, feasible. `seed`: another for every robot
  /// and rank.
  CertificateAgent(const SessionGraph& part, LiftedPoses X, std::uint32_t seed);

  /// Own keyframes whose rows others need, ascending.
  [[nodiscard]] const std::vector<KeyframeIndex>& public_keyframes() const { return border_.own; }

  /// Columns of the public keyframes of X, r x 4m.
  [[nodiscard]] LiftedPoses public_poses() const { return public_columns(X_); }
  /// Rows of a neighbour's public poses, of X or of a vector, in the order of its keyframes.
  void set_neighbour(RobotId robot, const std::vector<KeyframeIndex>& keyframes,
                     const LiftedPoses& columns);

  /// After all neighbours' X: Lambda, and this robot's part of the first sum: the Gram matrix of
  /// the kernel; in a last column cost (edges to robots with higher ids left out), sum of kappa,
  /// poses.
  [[nodiscard]] Eigen::MatrixXd kernel_sums();
  /// The first sum over the team. Prepares the first vector.
  void set_kernel(const Eigen::MatrixXd& gram);

  /// Public columns of the next search direction, 1 x 4m.
  [[nodiscard]] LiftedPoses public_direction() const { return public_columns(w_); }
  /// After all neighbours' directions: this robot's part of the sum of an iteration.
  [[nodiscard]] Eigen::MatrixXd iteration_sums();
  /// The sum over the team: one step of LOBPCG.
  CertificateState iterate(const Eigen::MatrixXd& sums);

  /// Cost and number of poses of the team, from the first sum.
  [[nodiscard]] double team_cost() const { return cost_; }
  [[nodiscard]] double team_poses() const { return poses_; }

  /// The present vector, 1 x 4n, of unit length over the team.
  [[nodiscard]] const LiftedPoses& vector() const { return x_; }

 private:
  [[nodiscard]] LiftedPoses public_columns(const LiftedPoses& M) const;
  [[nodiscard]] LiftedPoses times_S(const LiftedPoses& v);
  void make_multipliers();
  void factorise();
  void combine(const Eigen::Vector3d& y);

  RobotId self_;
  BlockBorder border_;
  LiftedPoses X_;
  LiftedPoses fixed_;         // r rows of poses, later 1 of a vector
  QuadraticProblem problem_;  // of rank 1
  std::vector<Eigen::Matrix3d> Lambda_;
  std::unique_ptr<const BlockCholesky> preconditioner_;
  Eigen::MatrixXd K_;  // kernel, orthonormal over the team, rows
  LiftedPoses x_, p_, w_, Sx_, Sp_, Sw_;
  double lambda_ = 0.0;
  double cost_ = 0.0;
  double degree_ = 1.0;  // mean sum of kappa at a pose
  double poses_ = 0.0;
  std::uint32_t seed_;
  int iterations_ = 0;
};

}  // namespace km
