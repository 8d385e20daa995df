#include "modules/tree_newton/frontal_cholesky.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace km {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Eliminates the first `pivots` scalar columns of the dense `front` (lower triangle) in place.
// These columns become L, and the rest becomes the Schur complement. False if a pivot is not
// positive.
bool eliminate(MatrixXd& front, Index pivots) {
  const Index rest = front.rows() - pivots;
  auto pivot_block = front.topLeftCorner(pivots, pivots);
  Eigen::LLT<Eigen::Ref<MatrixXd>> llt(pivot_block);
  if (llt.info() != Eigen::Success) return false;
  if (rest == 0) return true;
  auto below = front.bottomLeftCorner(rest, pivots);
  pivot_block.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(below);
  front.bottomRightCorner(rest, rest).selfadjointView<Eigen::Lower>().rankUpdate(below, -1.0);
  return true;
}

// Adds block (i, j) of a symmetric matrix to the lower triangle of `front`.
template <typename Block>
void add_block(MatrixXd& front, Index block, int i, int j, const Block& values) {
  if (i >= j)
    front.block(block * i, block * j, block, block) += values;
  else
    front.block(block * j, block * i, block, block) += values.transpose();
}

}  // namespace

bool FrontalCholesky::factorise(const BlockMatrix& A) {
  block_ = A.block();
  const std::size_t fronts = plan_->fronts().size();
  factors_.resize(fronts);
  rests_.assign(fronts, MatrixXd());
  local_.assign(at(plan_->nodes()), -1);
  schur_ = BlockMatrix::zero(block_, plan_->kept().size(), plan_->kept_pairs().size());
  for (std::size_t f = 0; f < fronts; ++f)
    if (!factorise_front(f, A)) return false;
  add_kept(A);
  return true;
}

bool FrontalCholesky::factorise_front(std::size_t f, const BlockMatrix& A) {
  const EliminationPlan::Front& front = plan_->fronts()[f];
  const Index pivots = block_ * front.pivots;
  const Index size = block_ * static_cast<Index>(front.nodes.size());
  for (std::size_t k = 0; k < front.nodes.size(); ++k)
    local_[at(front.nodes[k])] = static_cast<int>(k);
  const auto local = [&](int node) { return local_[at(node)]; };

  MatrixXd F = MatrixXd::Zero(size, size);
  for (int k = 0; k < front.pivots; ++k)
    F.block(block_ * k, block_ * k, block_, block_) = A.at(front.nodes[at(k)]);
  for (const int pair : front.pairs) {
    const auto& [i, j] = plan_->pairs()[at(pair)];
    add_block(F, block_, local(i), local(j), A.between(pair));
  }
  for (const int c : front.children) {
    const EliminationPlan::Front& child = plan_->fronts()[at(c)];
    MatrixXd& rest = rests_[at(c)];
    const auto first = at(child.pivots);
    for (std::size_t j = first; j < child.nodes.size(); ++j)
      for (std::size_t i = j; i < child.nodes.size(); ++i)
        add_block(F, block_, local(child.nodes[i]), local(child.nodes[j]),
                  rest.block(block_ * static_cast<Index>(i - first),
                             block_ * static_cast<Index>(j - first), block_, block_));
    rest.resize(0, 0);
  }
  if (!eliminate(F, pivots)) return false;
  factors_[f] = F.leftCols(pivots);
  MatrixXd rest = F.bottomRightCorner(size - pivots, size - pivots);
  if (front.parent >= 0)
    rests_[f] = std::move(rest);
  else
    add_to_schur(front, rest);
  return true;
}

void FrontalCholesky::add_to_schur(const EliminationPlan::Front& front, const MatrixXd& rest) {
  const auto first = at(front.pivots);
  const auto kept = [&](std::size_t k) { return plan_->place_of_kept()[at(front.nodes[k])]; };
  for (std::size_t j = first; j < front.nodes.size(); ++j) {
    const Index col = block_ * static_cast<Index>(j - first);
    const MatrixXd lower = rest.block(col, col, block_, block_);
    schur_.at(kept(j)) += lower.selfadjointView<Eigen::Lower>();
    for (std::size_t i = j + 1; i < front.nodes.size(); ++i) {
      const auto values = rest.block(block_ * static_cast<Index>(i - first), col, block_, block_);
      schur_.add(index_of(plan_->kept_pairs(), kept(i), kept(j)), kept(i) > kept(j), values);
    }
  }
}

void FrontalCholesky::add_kept(const BlockMatrix& A) {
  for (std::size_t k = 0; k < plan_->kept().size(); ++k)
    schur_.at(static_cast<int>(k)) += A.at(plan_->kept()[k]);
  for (std::size_t p = 0; p < plan_->pairs().size(); ++p) {
    const auto& [i, j] = plan_->pairs()[p];
    const int a = plan_->place_of_kept()[at(i)];
    const int b = plan_->place_of_kept()[at(j)];
    if (a < 0 || b < 0) continue;
    schur_.add(index_of(plan_->kept_pairs(), a, b), a > b, A.between(static_cast<int>(p)));
  }
}

void FrontalCholesky::forward(MatrixXd& C) const {
  MatrixXd rows;
  for (std::size_t f = 0; f < factors_.size(); ++f) {
    const EliminationPlan::Front& front = plan_->fronts()[f];
    const Index pivots = block_ * front.pivots;
    const Index rest = factors_[f].rows() - pivots;
    rows.resize(pivots, C.cols());
    for (int k = 0; k < front.pivots; ++k)
      rows.middleRows(block_ * k, block_) = C.middleRows(block_ * front.nodes[at(k)], block_);
    factors_[f].topRows(pivots).triangularView<Eigen::Lower>().solveInPlace(rows);
    for (int k = 0; k < front.pivots; ++k)
      C.middleRows(block_ * front.nodes[at(k)], block_) = rows.middleRows(block_ * k, block_);
    if (rest == 0) continue;
    const MatrixXd change = factors_[f].bottomRows(rest) * rows;
    for (std::size_t k = at(front.pivots); k < front.nodes.size(); ++k)
      C.middleRows(block_ * front.nodes[k], block_) -=
          change.middleRows(block_ * (static_cast<Index>(k) - front.pivots), block_);
  }
}

void FrontalCholesky::backward(MatrixXd& X) const {
  MatrixXd rows;
  for (std::size_t f = factors_.size(); f-- > 0;) {
    const EliminationPlan::Front& front = plan_->fronts()[f];
    const Index pivots = block_ * front.pivots;
    const Index rest = factors_[f].rows() - pivots;
    rows.resize(factors_[f].rows(), X.cols());
    for (std::size_t k = 0; k < front.nodes.size(); ++k)
      rows.middleRows(block_ * static_cast<Index>(k), block_) =
          X.middleRows(block_ * front.nodes[k], block_);
    auto solved = rows.topRows(pivots);
    if (rest > 0)
      solved.noalias() -= factors_[f].bottomRows(rest).transpose() * rows.bottomRows(rest);
    factors_[f].topRows(pivots).triangularView<Eigen::Lower>().transpose().solveInPlace(solved);
    for (int k = 0; k < front.pivots; ++k)
      X.middleRows(block_ * front.nodes[at(k)], block_) = rows.middleRows(block_ * k, block_);
  }
}

// Returns the blocks of the inverse for the nodes that a front of this factorisation leaves to
// later fronts. If the front has a parent, these nodes are in the parent, and the blocks come from
// `of_parent`. Otherwise these nodes are kept, and the blocks come from `kept`. `place`: index of
// each of these nodes in the parent front or in the list of kept nodes.
MatrixXd FrontalCholesky::inverse_of_rest(const std::vector<int>& place, const MatrixXd& of_parent,
                                          const BlockMatrix& kept) const {
  const auto rest = static_cast<Index>(place.size());
  MatrixXd Z(block_ * rest, block_ * rest);
  for (Index i = 0; i < rest; ++i)
    for (Index j = 0; j < rest; ++j) {
      const int a = place[at(i)], b = place[at(j)];
      auto block = Z.block(block_ * i, block_ * j, block_, block_);
      if (of_parent.size() > 0)
        block = of_parent.block(block_ * a, block_ * b, block_, block_);
      else if (a == b)
        block = kept.at(a);
      else if (a < b)
        block = kept.between(index_of(plan_->kept_pairs(), a, b));
      else
        block = kept.between(index_of(plan_->kept_pairs(), a, b)).transpose();
    }
  return Z;
}

// At first, Z has the inverse of a front at the nodes below its pivots. The pivots are added in
// groups, the last ones first. Let [L; M] be the columns of a group in the factor, and G = M L^-1.
// Then the new blocks are -Z G and (L L^T)^-1 + G^T Z G.
void FrontalCholesky::invert_pivots(const MatrixXd& factor, MatrixXd& Z) const {
  constexpr Index kGroup = 48;  // columns
  const Index rows = factor.rows();
  for (Index end = factor.cols(); end > 0;) {
    const Index first = std::max(Index{0}, end - kGroup), columns = end - first, rest = rows - end;
    const auto L = factor.block(first, first, columns, columns).triangularView<Eigen::Lower>();
    const MatrixXd inverse_L = L.solve(MatrixXd::Identity(columns, columns));
    MatrixXd corner = inverse_L.transpose() * inverse_L;
    if (rest > 0) {
      const MatrixXd G = factor.block(end, first, rest, columns) * inverse_L;
      auto below = Z.block(end, first, rest, columns);
      below.noalias() = -Z.bottomRightCorner(rest, rest) * G;
      Z.block(first, end, columns, rest) = below.transpose();
      corner.noalias() -= G.transpose() * below;
    }
    Z.block(first, first, columns, columns) = corner;
    end = first;
  }
}

BlockMatrix FrontalCholesky::selected_inverse(const BlockMatrix& kept) const {
  BlockMatrix inverse = BlockMatrix::zero(block_, at(plan_->nodes()), plan_->pairs().size());
  std::vector<MatrixXd> inverses(factors_.size());
  MatrixXd none;
  std::vector<int> local(at(plan_->nodes()));  // place in a front
  const auto number = [&](const EliminationPlan::Front& front) {
    for (std::size_t k = 0; k < front.nodes.size(); ++k)
      local[at(front.nodes[k])] = static_cast<int>(k);
  };
  const auto is_first_child = [&](std::size_t f) {
    const auto parent = at(plan_->fronts()[f].parent);
    return plan_->fronts()[parent].children.front() == static_cast<int>(f);
  };
  for (std::size_t f = factors_.size(); f-- > 0;) {
    const EliminationPlan::Front& front = plan_->fronts()[f];
    const bool has_parent = front.parent >= 0;
    if (has_parent) number(plan_->fronts()[at(front.parent)]);
    std::vector<int> place;
    for (std::size_t k = at(front.pivots); k < front.nodes.size(); ++k) {
      const auto node = at(front.nodes[k]);
      place.push_back(has_parent ? local[node] : plan_->place_of_kept()[node]);
    }
    MatrixXd& Z = inverses[f];
    Z.resize(factors_[f].rows(), factors_[f].rows());
    const Index rest = block_ * static_cast<Index>(place.size());
    MatrixXd& of_parent = has_parent ? inverses[at(front.parent)] : none;
    Z.bottomRightCorner(rest, rest) = inverse_of_rest(place, of_parent, kept);
    invert_pivots(factors_[f], Z);
    number(front);
    add_front(front, Z, local, inverse);
    // Only the children of a front need its inverse. Because fronts are visited in reverse order,
    // the first child is the last one to need it.
    if (front.children.empty()) Z.resize(0, 0);
    if (has_parent && is_first_child(f)) of_parent.resize(0, 0);
  }
  place_kept(kept, inverse);
  return inverse;
}

// Copies the diagonal blocks of the pivots of a front, and its couplings, to `inverse`.
void FrontalCholesky::add_front(const EliminationPlan::Front& front, const MatrixXd& Z,
                                const std::vector<int>& local, BlockMatrix& inverse) const {
  const auto block = [&](int i, int j) { return Z.block(block_ * i, block_ * j, block_, block_); };
  for (int k = 0; k < front.pivots; ++k) inverse.at(front.nodes[at(k)]) = block(k, k);
  for (const int pair : front.pairs) {
    const auto& [i, j] = plan_->pairs()[at(pair)];
    inverse.between(pair) = block(local[at(i)], local[at(j)]);
  }
}

void FrontalCholesky::place_kept(const BlockMatrix& kept, BlockMatrix& inverse) const {
  for (std::size_t k = 0; k < plan_->kept().size(); ++k)
    inverse.at(plan_->kept()[k]) = kept.at(static_cast<int>(k));
  for (std::size_t p = 0; p < plan_->pairs().size(); ++p) {
    const auto& [i, j] = plan_->pairs()[p];
    const int a = plan_->place_of_kept()[at(i)];
    const int b = plan_->place_of_kept()[at(j)];
    if (a < 0 || b < 0) continue;
    inverse.add(static_cast<int>(p), a > b, kept.between(index_of(plan_->kept_pairs(), a, b)));
  }
}

}  // namespace km
