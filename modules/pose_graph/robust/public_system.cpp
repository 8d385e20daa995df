#include "modules/pose_graph/robust/public_system.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "modules/pose_graph/newton/robot_system.hpp"
#include "modules/pose_graph/robust/loose_links.hpp"

namespace km {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of the diagonal: holds a robot that only loose links join, in the preconditioner.
constexpr double kHold = 1e-3;
constexpr int kMaxIterations = 300;

NodePair ordered(Index i, Index j) {
  return {static_cast<int>(std::min(i, j)), static_cast<int>(std::max(i, j))};
}

}  // namespace

PublicSystem::PublicSystem(std::shared_ptr<const PublicGraph> graph, int dimension)
    : graph_(std::move(graph)),
      dimension_(dimension),
      block_(tangent_size(dimension)),
      loose_(loose_links(*graph_)),
      plan_(make_plan()),
      factor_(plan_) {}

std::shared_ptr<const EliminationPlan> PublicSystem::make_plan() {
  std::vector<NodePair> all;
  for (const auto& [robot, size] : graph_->sizes())
    all.insert(all.end(), graph_->pairs(robot).begin(), graph_->pairs(robot).end());
  for (std::size_t k = 0; k < loose_.size(); ++k)
    if (!loose_[k]) all.push_back(ordered(graph_->links()[k].i, graph_->links()[k].j));
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  const auto place = [&](const NodePair& pair) {
    return static_cast<int>(std::lower_bound(all.begin(), all.end(), pair) - all.begin());
  };
  for (const auto& [robot, size] : graph_->sizes())
    for (const NodePair& pair : graph_->pairs(robot)) pairs_of_part_[robot].push_back(place(pair));
  for (std::size_t k = 0; k < loose_.size(); ++k)
    pair_of_link_.push_back(loose_[k] ? -1
                                      : place(ordered(graph_->links()[k].i, graph_->links()[k].j)));
  std::vector<bool> keep(static_cast<std::size_t>(graph_->nodes()), false);
  keep[keep.size() / 2] = true;
  return std::make_shared<const EliminationPlan>(std::move(keep), std::move(all));
}

void PublicSystem::set_part(RobotId robot, const BlockMatrix& schur) {
  const Index size = graph_->sizes().at(robot);
  const auto pairs = static_cast<Index>(graph_->pairs(robot).size());
  if (schur.block() != block_ || schur.diagonal.cols() != block_ * size ||
      schur.coupling.cols() != block_ * pairs)
    throw std::invalid_argument("PublicSystem: the Schur complement of robot " +
                                std::to_string(robot) + " has another size than its pattern");
  parts_[robot] = schur;
}

void PublicSystem::add_parts() {
  sum_ =
      BlockMatrix::zero(block_, static_cast<std::size_t>(graph_->nodes()), plan_->pairs().size());
  for (const auto& [robot, schur] : parts_) {
    const int first = graph_->first(robot);
    for (int k = 0; k < graph_->sizes().at(robot); ++k) sum_.at(first + k) += schur.at(k);
    const auto pairs = pairs_of_part_.find(robot);
    if (pairs == pairs_of_part_.end()) continue;
    for (std::size_t p = 0; p < pairs->second.size(); ++p)
      sum_.between(pairs->second[p]) += schur.between(static_cast<int>(p));
  }
}

void PublicSystem::add_link(std::size_t k, const EdgeModel& model) {
  const PublicGraph::Link& e = graph_->links()[k];
  const Index from = block_ == 3 ? 2 : 0;  // planar: [w_z; v_x; v_y]
  const auto part = [&](const Matrix6& H) { return H.block(from, from, block_, block_); };
  slope_.segment(block_ * e.i, block_) -= model.g_i.segment(from, block_);
  slope_.segment(block_ * e.j, block_) -= model.g_j.segment(from, block_);
  if (loose_[k]) {
    loose_links_.push_back({e.i, e.j, part(model.H_ii), part(model.H_ij), part(model.H_jj)});
    return;
  }
  sum_.at(static_cast<int>(e.i)) += part(model.H_ii);
  sum_.at(static_cast<int>(e.j)) += part(model.H_jj);
  if (e.i < e.j)
    sum_.between(pair_of_link_[k]) += part(model.H_ij);
  else
    sum_.between(pair_of_link_[k]) += part(model.H_ij).transpose();
}

bool PublicSystem::factorise(std::span<const SE3> poses, std::span<const double> weights,
                             Curvature curvature) {
  if (curvature == Curvature::kFull && try_factorise(poses, weights, curvature)) return true;
  return try_factorise(poses, weights, Curvature::kGaussNewton);
}

bool PublicSystem::try_factorise(std::span<const SE3> poses, std::span<const double> weights,
                                 Curvature curvature) {
  add_parts();
  loose_links_.clear();
  slope_ = VectorXd::Zero(block_ * graph_->nodes());
  for (std::size_t k = 0; k < weights.size(); ++k) {
    if (weights[k] == 0.0) continue;
    BlockEdge e = graph_->links()[k];
    e.kappa *= weights[k];
    e.tau *= weights[k];
    add_link(k, model_edge(e, poses[static_cast<std::size_t>(e.i)],
                           poses[static_cast<std::size_t>(e.j)], curvature));
  }
  if (loose_links_.empty()) return factor_.factorise(sum_);
  BlockMatrix held = sum_;
  for (const int node : nodes_to_hold(*graph_, loose_, weights))
    held.at(node).diagonal() *= 1.0 + kHold;
  return factor_.factorise(held);
}

PublicSystem::Solution PublicSystem::solve(const VectorXd& reduced, double accuracy) const {
  if (reduced.size() != slope_.size())
    throw std::invalid_argument("PublicSystem: " + std::to_string(reduced.size()) +
                                " right-hand sides for " + std::to_string(slope_.size()) +
                                " unknowns");
  VectorXd C = reduced + slope_;
  C.segment(block_ * (graph_->nodes() / 2), block_).setZero();
  Solution solution = refine(C, accuracy);
  solution.decrement = C.dot(solution.x.reshaped());
  return solution;
}

// Preconditioned conjugate gradients; one iteration where the factorisation is of everything.
PublicSystem::Solution PublicSystem::refine(const VectorXd& C, double accuracy) const {
  Solution solution{.x = MatrixXd::Zero(block_, graph_->nodes())};
  VectorXd z = precondition(C);
  if (loose_links_.empty()) {
    solution.x = z.reshaped(block_, graph_->nodes());
    return solution;
  }
  VectorXd r = C;
  VectorXd p = z;
  double rz = r.dot(z);
  const double enough = accuracy * accuracy * rz;
  while (rz > enough && solution.iterations < kMaxIterations) {
    const VectorXd Ap = product(p);
    const double curvature = p.dot(Ap);
    if (!(curvature > 0.0)) break;
    ++solution.iterations;
    const double step = rz / curvature;
    solution.x.reshaped() += step * p;
    r -= step * Ap;
    z = precondition(r);
    const double rz_next = r.dot(z);
    p = z + rz_next / rz * p;
    rz = rz_next;
  }
  return solution;
}

VectorXd PublicSystem::product(const VectorXd& x) const {
  VectorXd y(x.size());
  for (int k = 0; k < graph_->nodes(); ++k)
    y.segment(block_ * k, block_).noalias() = sum_.at(k) * x.segment(block_ * k, block_);
  const auto couple = [&](Index i, Index j, const auto& H) {
    y.segment(block_ * i, block_).noalias() += H * x.segment(block_ * j, block_);
    y.segment(block_ * j, block_).noalias() += H.transpose() * x.segment(block_ * i, block_);
  };
  const auto& pairs = plan_->pairs();
  for (std::size_t p = 0; p < pairs.size(); ++p)
    couple(pairs[p][0], pairs[p][1], sum_.between(static_cast<int>(p)));
  for (const Loose& e : loose_links_) {
    y.segment(block_ * e.i, block_) += e.H_ii * x.segment(block_ * e.i, block_);
    y.segment(block_ * e.j, block_) += e.H_jj * x.segment(block_ * e.j, block_);
    couple(e.i, e.j, e.H_ij);
  }
  y.segment(block_ * (graph_->nodes() / 2), block_).setZero();
  return y;
}

VectorXd PublicSystem::precondition(VectorXd r) const {
  MatrixXd X = std::move(r);
  factor_.forward(X);
  X.middleRows(block_ * (graph_->nodes() / 2), block_).setZero();
  factor_.backward(X);
  return X;
}

}  // namespace km
