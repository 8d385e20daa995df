#include "modules/pose_graph/newton/separator_system.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <stdexcept>
#include <string>

namespace km {
namespace {

[[noreturn]] void refuse(RobotId robot, const char* why) {
  throw std::invalid_argument("SeparatorSystem: the share of robot " + std::to_string(robot) + ' ' +
                              why);
}

bool is_place(int k, const std::vector<int>& list) {
  return 0 <= k && k < static_cast<int>(list.size());
}

}  // namespace

void SeparatorSystem::learn_pattern(const NewtonShares& shares) {
  for (const auto& [robot, share] : shares)
    separators_.insert(separators_.end(), share->kept.begin(), share->kept.end());
  std::sort(separators_.begin(), separators_.end());
  separators_.erase(std::unique(separators_.begin(), separators_.end()), separators_.end());
  std::vector<NodePair> pairs;
  for (const auto& [robot, share] : shares) {
    Member& member = members_[robot];
    for (const KeyframeId& id : share->kept)
      member.kept.push_back(static_cast<int>(
          std::lower_bound(separators_.begin(), separators_.end(), id) - separators_.begin()));
    for (const auto& [i, j] : share->pairs) {
      if (!is_place(i, member.kept) || !is_place(j, member.kept) || i == j)
        refuse(robot, "couples what it does not keep");
      const int a = member.kept[static_cast<std::size_t>(i)];
      const int b = member.kept[static_cast<std::size_t>(j)];
      if (a == b) refuse(robot, "keeps a pose twice");
      pairs.push_back({std::min(a, b), std::max(a, b)});
      member.transposed.push_back(a > b);
    }
  }
  std::vector<NodePair> all = pairs;
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  auto pair = pairs.begin();
  for (const auto& [robot, share] : shares)
    for (std::size_t p = 0; p < share->pairs.size(); ++p)
      members_[robot].pair.push_back(
          static_cast<int>(std::lower_bound(all.begin(), all.end(), *pair++) - all.begin()));
  std::vector<bool> keep(separators_.size(), false);
  if (!keep.empty()) keep[keep.size() / 2] = true;
  plan_ = std::make_shared<const EliminationPlan>(std::move(keep), std::move(all));
}

bool SeparatorSystem::factorise(const NewtonShares& shares) {
  if (!plan_) learn_pattern(shares);
  const Eigen::Index block = shares.empty() ? 0 : shares.begin()->second->schur.block();
  BlockMatrix sum = BlockMatrix::zero(block, separators_.size(), plan_->pairs().size());
  for (const auto& [robot, share] : shares) {
    const auto member = members_.find(robot);
    if (member == members_.end()) refuse(robot, "comes from no member");
    const auto& [kept, pair, transposed] = member->second;
    const BlockMatrix& schur = share->schur;
    if (schur.block() != block || schur.diagonal.cols() != block * static_cast<int>(kept.size()) ||
        schur.coupling.cols() != block * static_cast<int>(pair.size()))
      refuse(robot, "has another size than its pattern");
    for (std::size_t k = 0; k < kept.size(); ++k) sum.at(kept[k]) += schur.at(static_cast<int>(k));
    for (std::size_t p = 0; p < pair.size(); ++p) {
      if (transposed[p])
        sum.between(pair[p]) += schur.between(static_cast<int>(p)).transpose();
      else
        sum.between(pair[p]) += schur.between(static_cast<int>(p));
    }
    add_kept_edges(*share, member->second, sum);
  }
  factor_.emplace(plan_);
  return factor_->factorise(sum);
}

void SeparatorSystem::add_kept_edges(const NewtonShare& share, const Member& member,
                                     BlockMatrix& sum) const {
  const Eigen::Index B = sum.block();
  const auto part = [B](const Matrix6& H) {  // of what moves: see robot_system.hpp
    const Eigen::Index first = B == 3 ? 2 : 0;
    return H.block(first, first, B, B);
  };
  for (const KeptEdge& e : share.edges) {
    if (!is_place(e.pair, member.pair) || (B != 3 && B != 6))
      refuse(share.robot, "has an edge between poses that it does not couple");
    const int pair = member.pair[static_cast<std::size_t>(e.pair)];
    const auto& [low, high] = plan_->pairs()[static_cast<std::size_t>(pair)];
    const bool downwards = e.transposed != member.transposed[static_cast<std::size_t>(e.pair)];
    const EdgeModel model = e.model(share.curvature);
    sum.at(downwards ? high : low) += part(model.H_ii);
    sum.at(downwards ? low : high) += part(model.H_jj);
    if (downwards)
      sum.between(pair) += part(model.H_ij).transpose();
    else
      sum.between(pair) += part(model.H_ij);
  }
}

SeparatorSystem::Solution SeparatorSystem::reduce(const NewtonShares& shares, Eigen::Index block,
                                                  Eigen::Index columns) const {
  Solution solution;
  solution.x =
      Eigen::MatrixXd::Zero(block * static_cast<Eigen::Index>(separators_.size()), columns);
  for (const auto& [robot, share] : shares) {
    const std::vector<int>& kept = members_.at(robot).kept;
    if (share->reduced.rows() != block * static_cast<Eigen::Index>(kept.size()) ||
        share->reduced.cols() != columns)
      refuse(robot, "has a right-hand side of another size");
    for (std::size_t k = 0; k < kept.size(); ++k)
      solution.x.middleRows(block * kept[k], block) +=
          share->reduced.middleRows(block * static_cast<Eigen::Index>(k), block);
    solution.decrement += share->decrement;
  }
  factor_->forward(solution.x);
  return solution;
}

// The one whose unknowns are not eliminated.
Eigen::Index SeparatorSystem::middle_row(Eigen::Index block) const {
  return block * static_cast<Eigen::Index>(separators_.size() / 2);
}

SeparatorSystem::Solution SeparatorSystem::solve(const NewtonShares& shares,
                                                 const Eigen::MatrixXd& given) const {
  Solution solution = reduce(shares, given.rows(), given.cols());
  auto middle = solution.x.middleRows(middle_row(given.rows()), given.rows());
  middle.setZero();
  solution.decrement += solution.x.squaredNorm();
  middle = given;
  factor_->backward(solution.x);
  return solution;
}

SeparatorSystem::Solution SeparatorSystem::solve_upright(const NewtonShares& shares) const {
  Solution solution = reduce(shares, 6, 1);
  auto middle = solution.x.middleRows<6>(middle_row(6));
  const Eigen::Vector3d c = middle.topRows<3>();
  middle.setZero();
  solution.decrement += solution.x.squaredNorm();
  // What is left of the turns of the team as a whole: none of it resists the one about the
  // vertical.
  const Eigen::Matrix3d S = factor_->schur().at(0).topLeftCorner<3, 3>();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> turns(S);
  const Eigen::Matrix<double, 3, 2> tilts = turns.eigenvectors().rightCols<2>();
  const Eigen::Vector2d stiffness = turns.eigenvalues().tail<2>();
  if (stiffness.minCoeff() > 0.0) {
    const Eigen::Vector2d reduced = tilts.transpose() * c;
    const Eigen::Vector2d step = reduced.cwiseQuotient(stiffness);
    solution.decrement += reduced.dot(step);
    middle.topRows<3>() = tilts * step;
  }
  factor_->backward(solution.x);
  return solution;
}

}  // namespace km
