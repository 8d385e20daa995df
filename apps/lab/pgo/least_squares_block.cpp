#include "apps/lab/pgo/least_squares_block.hpp"

#include <cmath>
#include <stdexcept>

namespace km {

LeastSquaresBlock::LeastSquaresBlock(Eigen::Index poses, Eigen::Index width, Eigen::MatrixXd x,
                                     bool hold_first)
    : poses_(poses), width_(width), held_(hold_first ? 1 : 0), x_(std::move(x)) {}

void LeastSquaresBlock::add_own(Eigen::Index i, Eigen::Index j, const EdgeForm& form) {
  own_.push_back({i, j, form});
}

void LeastSquaresBlock::add_other(Eigen::Index own, std::size_t peer, Eigen::Index other,
                                  const EdgeForm& form) {
  others_.push_back({own, peer, other, form});
}

void LeastSquaresBlock::set_other(std::size_t peer, Eigen::Index other, const Eigen::MatrixXd& x) {
  received_[{peer, other}] = x;
}

const Eigen::MatrixXd* LeastSquaresBlock::known(const Other& edge) const {
  const auto found = received_.find({edge.peer, edge.other});
  return found == received_.end() ? nullptr : &found->second;
}

void LeastSquaresBlock::factorise() {
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&](Eigen::Index i, Eigen::Index j, const Eigen::MatrixXd& block) {
    if (i < held_ || j < held_) return;
    for (Eigen::Index r = 0; r < width_; ++r)
      for (Eigen::Index c = 0; c < width_; ++c)
        entries.emplace_back(static_cast<int>(width_ * (i - held_) + r),
                             static_cast<int>(width_ * (j - held_) + c), block(r, c));
  };
  for (const Own& e : own_) {
    add(e.i, e.i, e.form.H_ii);
    add(e.j, e.j, e.form.H_jj);
    add(e.i, e.j, e.form.H_ij);
    add(e.j, e.i, e.form.H_ij.transpose());
  }
  for (const Other& e : others_)
    if (known(e) != nullptr) add(e.own, e.own, e.form.H_ii);
  const Eigen::Index unknowns = width_ * (poses_ - held_);
  Eigen::SparseMatrix<double> H(unknowns, unknowns);
  H.setFromTriplets(entries.begin(), entries.end());
  factor_ = std::make_unique<Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>>(H);
  const bool fixed =
      factor_->info() == Eigen::Success &&
      factor_->vectorD().minCoeff() > 1e-13 * std::max(1e-300, factor_->vectorD().maxCoeff());
  if (!fixed) throw std::invalid_argument("what is known does not fix all poses of the block");
  received_when_factorised_ = received_.size();
}

void LeastSquaresBlock::solve() {
  const Eigen::Index unknowns = width_ * (poses_ - held_);
  if (unknowns == 0) return;
  if (!factor_ || received_when_factorised_ != received_.size()) factorise();
  Eigen::MatrixXd g = Eigen::MatrixXd::Zero(width_ * poses_, x_.cols());
  for (const Own& e : own_) {
    g.middleRows(width_ * e.i, width_) += e.form.g_i;
    g.middleRows(width_ * e.j, width_) += e.form.g_j;
    if (e.i < held_) g.middleRows(width_ * e.j, width_) += e.form.H_ij.transpose() * at(e.i);
    if (e.j < held_) g.middleRows(width_ * e.i, width_) += e.form.H_ij * at(e.j);
  }
  for (const Other& e : others_)
    if (const Eigen::MatrixXd* x = known(e))
      g.middleRows(width_ * e.own, width_) += e.form.g_i + e.form.H_ij * *x;
  const Eigen::MatrixXd solution = factor_->solve(-g.bottomRows(unknowns));
  change_ =
      (solution - x_.bottomRows(unknowns)).norm() / std::sqrt(static_cast<double>(solution.size()));
  x_.bottomRows(unknowns) = solution;
}

}  // namespace km
