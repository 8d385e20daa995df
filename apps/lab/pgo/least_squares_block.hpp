#pragma once

#include <Eigen/SparseCholesky>
#include <map>
#include <memory>
#include <vector>

namespace km {

/// Quadratic form of one edge in its two ends x_i, x_j (w x c each):
///     x_i^T H_ii x_i + 2 x_i^T H_ij x_j + x_j^T H_jj x_j + 2 g_i^T x_i + 2 g_j^T x_j.
struct EdgeForm {
  Eigen::MatrixXd H_ii, H_ij, H_jj;  ///< w x w
  Eigen::MatrixXd g_i, g_j;          ///< w x c
};

/// One robot's part of a linear least squares problem over a pose graph. The unknowns are w rows
/// and c columns for each of its poses; the values of its neighbours are given. Used for block
/// Gauss-Seidel sweeps: each solve is exact, and the factorisation is reused.
class LeastSquaresBlock {
 public:
  /// `hold_first`: pose 0, the anchor of the team, is constant.
  LeastSquaresBlock(Eigen::Index poses, Eigen::Index width, Eigen::MatrixXd x, bool hold_first);

  void add_own(Eigen::Index i, Eigen::Index j, const EdgeForm& form);
  /// Adds an edge whose other end is pose `other` of robot `peer`. `form` has the ends (own,
  /// other).
  void add_other(Eigen::Index own, std::size_t peer, Eigen::Index other, const EdgeForm& form);

  /// Sets the values of a neighbour's pose. Edges to poses without values are left out ("flagged").
  void set_other(std::size_t peer, Eigen::Index other, const Eigen::MatrixXd& x);

  /// Solves for the own unknowns. Throws std::invalid_argument if the known values do not determine
  /// them.
  void solve();

  [[nodiscard]] Eigen::MatrixXd at(Eigen::Index pose) const {
    return x_.middleRows(width_ * pose, width_);
  }
  /// Root mean square of the entries' changes in the last solve().
  [[nodiscard]] double change() const { return change_; }

 private:
  struct Own {
    Eigen::Index i, j;
    EdgeForm form;
  };
  struct Other {
    Eigen::Index own;
    std::size_t peer;
    Eigen::Index other;
    EdgeForm form;
  };

  [[nodiscard]] const Eigen::MatrixXd* known(const Other& edge) const;
  void factorise();

  Eigen::Index poses_;
  Eigen::Index width_;
  Eigen::Index held_;  // number of constant poses at the beginning: 0 or 1
  Eigen::MatrixXd x_;  // (w n) x c
  std::vector<Own> own_;
  std::vector<Other> others_;
  std::map<std::pair<std::size_t, Eigen::Index>, Eigen::MatrixXd> received_;
  std::size_t received_when_factorised_ = 0;
  std::unique_ptr<Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>> factor_;
  double change_ = 0.0;
};

}  // namespace km
