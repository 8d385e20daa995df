#include "modules/rbcd/quadratic_problem.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "modules/rbcd/rank_dispatch.hpp"

namespace km {
namespace {

// Diagonal that precondition() adds on translations, relative to the largest sum of tau over the
// edges of one pose. It only keeps the preconditioner definite. A larger value would slow down the
// motions of long chains of poses, which change the cost little. Rotations need a larger value,
// relative to the largest sum of kappa: otherwise the preconditioner amplifies steps of rotations
// off their manifold.
constexpr double kTranslationShift = 1e-10, kRotationShift = 1e-3;

Eigen::Vector4d weights(double kappa, double tau) {
  return {kappa, kappa, kappa, tau};
}

void append_block(std::vector<Eigen::Triplet<double>>& entries, Eigen::Index i, Eigen::Index j,
                  const Eigen::Matrix4d& block) {
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      if (block(r, c) != 0.0)
        entries.emplace_back(static_cast<int>(4 * i + r), static_cast<int>(4 * j + c), block(r, c));
}

bool usable(const SE3& T, double kappa, double tau) {
  return T.matrix().allFinite() && kappa > 0.0 && tau > 0.0 && std::isfinite(kappa) &&
         std::isfinite(tau);
}

}  // namespace

std::vector<SE3> chordal_initialisation(Eigen::Index poses, std::span<const BlockEdge> edges) {
  std::vector<PoseEdge> own;
  for (const BlockEdge& e : edges) own.push_back(e.of_one_robot());
  return chordal_initialisation(poses, own);
}

double edge_cost(const Eigen::Ref<const Eigen::MatrixXd>& X_i,
                 const Eigen::Ref<const Eigen::MatrixXd>& X_j, const SE3& T_i_j, double kappa,
                 double tau) {
  double rotation = 0.0;
  double translation = 0.0;
  for (Eigen::Index row = 0; row < X_i.rows(); ++row) {
    const Eigen::RowVector3d y = X_i.row(row).head<3>();
    rotation += (X_j.row(row).head<3>() - y * T_i_j.linear()).squaredNorm();
    const double e = X_j(row, 3) - X_i(row, 3) - y.dot(T_i_j.translation());
    translation += e * e;
  }
  return kappa * rotation + tau * translation;
}

QuadraticProblem::QuadraticProblem(Eigen::Index rank, Eigen::Index poses,
                                   std::vector<BlockEdge> edges,
                                   std::vector<PublicEdge> public_edges,
                                   std::vector<VerticalPrior> verticals)
    : rank_(rank),
      poses_(poses),
      edges_(std::move(edges)),
      public_edges_(std::move(public_edges)),
      verticals_(std::move(verticals)),
      Q_(4 * poses, 4 * poses) {
  check();
  build();
  reset_linear_part();
}

void QuadraticProblem::check() const {
  const auto refuse = [](const char* kind, std::size_t k, const char* why) {
    throw std::invalid_argument(std::string("QuadraticProblem: ") + kind + ' ' + std::to_string(k) +
                                ' ' + why);
  };
  const auto outside = [&](Eigen::Index i) { return i < 0 || i >= poses_; };
  for (std::size_t k = 0; k < edges_.size(); ++k) {
    const BlockEdge& e = edges_[k];
    if (outside(e.i) || outside(e.j) || e.i == e.j)
      refuse("block edge", k, "names no pair of poses");
    if (!usable(e.T_i_j, e.kappa, e.tau))
      refuse("block edge", k, "is not finite with positive weights");
  }
  for (std::size_t k = 0; k < public_edges_.size(); ++k) {
    const PublicEdge& e = public_edges_[k];
    if (outside(e.own) || e.fixed < 0) refuse("public edge", k, "names no pair of poses");
    if (!usable(e.T, e.kappa, e.tau))
      refuse("public edge", k, "is not finite with positive weights");
  }
  for (std::size_t k = 0; k < verticals_.size(); ++k) {
    const VerticalPrior& v = verticals_[k];
    if (outside(v.pose)) refuse("vertical prior", k, "names no pose");
    if (!v.up.allFinite() || !(v.weight > 0.0) || !std::isfinite(v.weight))
      refuse("vertical prior", k, "is not finite with a positive weight");
  }
}

void QuadraticProblem::build() {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(64 * edges_.size() + 16 * public_edges_.size());
  for (const BlockEdge& e : edges_) {
    // The residual E of the edge is X_j - X_i T: tr(E Omega E^T) expanded.
    const Eigen::Matrix4d T = e.T_i_j.matrix();
    const Eigen::Matrix4d Omega = weights(e.kappa, e.tau).asDiagonal();
    append_block(entries, e.j, e.j, Omega);
    append_block(entries, e.i, e.i, T * Omega * T.transpose());
    append_block(entries, e.i, e.j, -T * Omega);
    append_block(entries, e.j, e.i, -Omega * T.transpose());
  }
  for (const PublicEdge& e : public_edges_) {
    const Eigen::Matrix4d Omega = weights(e.kappa, e.tau).asDiagonal();
    const Eigen::Matrix4d T = e.T.matrix();
    append_block(entries, e.own, e.own,
                 e.from_own ? Eigen::Matrix4d(T * Omega * T.transpose()) : Omega);
    fixed_count_ = std::max(fixed_count_, e.fixed + 1);
  }
  Q_.setFromTriplets(entries.begin(), entries.end());
}

void QuadraticProblem::set_fixed(LiftedPoses fixed) {
  if (fixed.rows() != rank_ || fixed.cols() < 4 * fixed_count_ || fixed.cols() % 4 != 0)
    throw std::invalid_argument("QuadraticProblem: fixed poses are " +
                                std::to_string(fixed.rows()) + 'x' + std::to_string(fixed.cols()) +
                                ", not " + std::to_string(rank_) + "x(at least " +
                                std::to_string(4 * fixed_count_) + ')');
  fixed_ = std::move(fixed);
  reset_linear_part();
  for (const PublicEdge& e : public_edges_) {
    const Eigen::Matrix4d Omega = weights(e.kappa, e.tau).asDiagonal();
    const Eigen::Matrix4d T = e.T.matrix();
    const Eigen::Matrix4d M =
        e.from_own ? Eigen::Matrix4d(Omega * T.transpose()) : Eigen::Matrix4d(T * Omega);
    G_.middleCols<4>(4 * e.own).noalias() -= fixed_.middleCols<4>(4 * e.fixed) * M;
  }
}

// The linear part of the verticals, independent of the fixed poses: w ||Y u - z||^2 = 2 w - 2 w z^T
// Y u.
void QuadraticProblem::reset_linear_part() {
  G_ = LiftedPoses::Zero(rank_, 4 * poses_);
  if (verticals_.empty()) return;
  const Eigen::VectorXd z = lifting_matrix(rank_).col(2);
  for (const VerticalPrior& v : verticals_)
    G_.middleCols<3>(4 * v.pose).noalias() -= v.weight * z * v.up.transpose();
}

double QuadraticProblem::public_edge_cost(std::size_t k, const LiftedPoses& X) const {
  const PublicEdge& e = public_edges_[k];
  const auto own = X.middleCols<4>(4 * e.own);
  const auto fixed = fixed_.middleCols<4>(4 * e.fixed);
  return e.from_own ? edge_cost(own, fixed, e.T, e.kappa, e.tau)
                    : edge_cost(fixed, own, e.T, e.kappa, e.tau);
}

double QuadraticProblem::cost(const LiftedPoses& X) const {
  // Computed from residuals, not from tr(X Q X^T), to avoid cancellation far from the origin.
  double sum = 0.0;
  for (const BlockEdge& e : edges_)
    sum += edge_cost(X.middleCols<4>(4 * e.i), X.middleCols<4>(4 * e.j), e.T_i_j, e.kappa, e.tau);
  for (std::size_t k = 0; k < public_edges_.size(); ++k) sum += public_edge_cost(k, X);
  for (const VerticalPrior& v : verticals_) sum += vertical_cost(v, X.middleCols<3>(4 * v.pose));
  return sum;
}

namespace {

// 2 X Q with the rank as a compile-time constant. Q is symmetric, so column j of the product uses
// column j of Q.
LiftedPoses twice_product(const LiftedPoses& X, const Eigen::SparseMatrix<double>& Q) {
  LiftedPoses product(X.rows(), X.cols());
  dispatch_rank(X.rows(), [&]<int kRank>() {
    Eigen::Matrix<double, kRank, 1> sum(X.rows());
    for (Eigen::Index j = 0; j < Q.cols(); ++j) {
      sum.setZero();
      for (Eigen::SparseMatrix<double>::InnerIterator q(Q, j); q; ++q)
        sum.noalias() += (2.0 * q.value()) * lifted_block<kRank, 1>(X, q.row());
      product.col(j) = sum;
    }
  });
  return product;
}

}  // namespace

LiftedPoses QuadraticProblem::euclidean_gradient(const LiftedPoses& X) const {
  return twice_product(X, Q_) + 2.0 * G_;
}

LiftedPoses QuadraticProblem::hessian_product(const LiftedPoses& X, const LiftedPoses& gradient,
                                              const LiftedPoses& V) const {
  LiftedPoses product = twice_product(V, Q_);
  dispatch_rank(rank_, [&]<int kRank>() {
    for (Eigen::Index i = 0; i < poses_; ++i) {
      const Eigen::Matrix3d S =
          lifted_block<kRank, 3>(X, 4 * i).transpose() * lifted_block<kRank, 3>(gradient, 4 * i);
      lifted_block<kRank, 3>(product, 4 * i).noalias() -=
          lifted_block<kRank, 3>(V, 4 * i) * (0.5 * (S + S.transpose())).eval();
    }
  });
  return project_tangent(X, product);
}

Eigen::Vector2d QuadraticProblem::largest_degrees() const {
  Eigen::Matrix2Xd degrees = Eigen::Matrix2Xd::Zero(2, poses_);
  for (const BlockEdge& e : edges_)
    for (const Eigen::Index i : {e.i, e.j}) degrees.col(i) += Eigen::Vector2d(e.kappa, e.tau);
  for (const PublicEdge& e : public_edges_) degrees.col(e.own) += Eigen::Vector2d(e.kappa, e.tau);
  return degrees.rowwise().maxCoeff();
}

LiftedPoses QuadraticProblem::precondition(const LiftedPoses& X, const LiftedPoses& V) const {
  if (!preconditioner_) {
    Eigen::SparseMatrix<double> A = 2.0 * Q_;
    const Eigen::Vector2d degree = largest_degrees();
    const double rotation = 2.0 * kRotationShift * degree.x();
    const double translation = 2.0 * kTranslationShift * degree.y();
    A.diagonal() += Eigen::Vector4d(rotation, rotation, rotation, translation).replicate(poses_, 1);
    preconditioner_ = std::make_unique<const BlockCholesky>(A);
  }
  return project_tangent(X, preconditioner_->solve_rows(V));
}

}  // namespace km
