#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "apps/lab/pgo_study/block_border.hpp"
#include "modules/rbcd/block_cholesky.hpp"

namespace km {

/// State of the search, which every robot computes equally from a sum over the team.
struct [[nodiscard]] CertificateState {
  double lambda = 0.0;    ///< Least Rayleigh quotient so far: an upper bound of the eigenvalue.
  double residual = 0.0;  ///< Residual of the previous vector, over the mean sum of kappa at a
                          ///< pose.
  int iterations = 0;
};

/// One robot's part of a distributed search for the smallest eigenvalue of the certificate matrix S
/// = Q - Lambda (see certificate.hpp) outside its kernel. At a critical point X, the kernel
/// contains the rows of X and the common translation. The method is LOBPCG (Knyazev, "Toward the
/// Optimal Preconditioned Eigensolver", SIAM J. Sci. Comput. 2001) for one vector, preconditioned
/// by a factorisation of the robot's own diagonal block of S. Vectors are 1 x 4n. Their inner
/// product has weight 1 on rotations and kTranslationWeight on translations [1/m^2]. The sign of
/// the least eigenvalue does not depend on this weight.
///
/// The robots exchange rows of public poses (first of X, then of one vector per iteration) and one
/// sum over the team per iteration. Every robot then takes the same step. A negative quotient
/// proves that X is no global minimum. A positive quotient that has converged from a random start
/// shows only that almost surely no negative one exists. certify() gives the proof.
class CertificateAgent {
 public:
  static constexpr double kTranslationWeight = 1e-6;

  /// `part`: result of part_of(). `X`: block of the robot, r x 4n, feasible. `seed`: different for
  /// every robot and rank.
  CertificateAgent(const SessionGraph& part, LiftedPoses X, std::uint32_t seed);

  /// Own keyframes on which edges to other robots end, ascending.
  [[nodiscard]] const std::vector<KeyframeIndex>& public_keyframes() const { return border_.own; }

  /// Columns of the public keyframes of X, r x 4m.
  [[nodiscard]] LiftedPoses public_poses() const { return public_columns(X_); }
  /// Sets the rows of a neighbour's public poses, of X or of a vector, in the order of its
  /// keyframes.
  void set_neighbour(RobotId robot, const std::vector<KeyframeIndex>& keyframes,
                     const LiftedPoses& columns);

  /// Computes Lambda and this robot's part of the first sum: the Gram matrix of the kernel. A last
  /// column holds the cost (without edges to robots with higher ids), the sum of kappa and the
  /// number of poses. Precondition: X of all neighbours is set.
  [[nodiscard]] Eigen::MatrixXd kernel_sums();
  /// Takes the first sum over the team, and prepares the first vector.
  void set_kernel(const Eigen::MatrixXd& gram);

  /// Public columns of the next search direction, 1 x 4m.
  [[nodiscard]] LiftedPoses public_direction() const { return public_columns(w_); }
  /// Returns this robot's part of the sum of an iteration. Precondition: the directions of all
  /// neighbours are set.
  [[nodiscard]] Eigen::MatrixXd iteration_sums();
  /// Takes one step of LOBPCG, given the sum over the team.
  CertificateState iterate(const Eigen::MatrixXd& sums);

  /// Cost and number of poses of the team, from the first sum.
  [[nodiscard]] double team_cost() const { return cost_; }
  [[nodiscard]] double team_poses() const { return poses_; }

  /// The current vector, 1 x 4n, of unit length over the team.
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
  LiftedPoses fixed_;         // neighbours' columns: r rows of X, later 1 row of a vector
  QuadraticProblem problem_;  // rank 1
  std::vector<Eigen::Matrix3d> Lambda_;
  std::unique_ptr<const BlockCholesky> preconditioner_;
  Eigen::MatrixXd K_;  // basis of the kernel as rows, orthonormal over the team
  LiftedPoses x_, p_, w_, Sx_, Sp_, Sw_;
  double lambda_ = 0.0;
  double cost_ = 0.0;
  double degree_ = 1.0;  // mean sum of kappa at a pose
  double poses_ = 0.0;
  std::uint32_t seed_;
  int iterations_ = 0;
};

}  // namespace km
