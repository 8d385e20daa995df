#include "modules/pose_graph/tree_front.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "modules/pose_graph/sparse_choice.hpp"

namespace km {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Ratio of weights from which on old second derivatives mislead a step: the stiffness of an edge is
// half or twice its correct value. Weights below kNoWeight are negligible compared to odometry.
constexpr double kWeightRatio = 2.0;
constexpr double kNoWeight = 0.02;
// An edge with a weight below this is rejected. It has no cost and no gradient; its stiffness only
// keeps the system regular.
constexpr double kRejected = 1e-6;

[[noreturn]] void refuse(RobotId robot, const std::string& what) {
  throw std::invalid_argument("TreeFront of robot " + std::to_string(robot) + ": " + what);
}

bool differs(double weight, double before) {
  const auto [less, more] = std::minmax(weight, before);
  return more > kNoWeight && more > kWeightRatio * less;
}

std::size_t at(int k) {
  return static_cast<std::size_t>(k);
}

// First row of a planar step in a tangent vector of SE(3): rotation about z and translation along x
// and y are adjacent.
constexpr Index first_of(Index block) {
  return block == 3 ? 2 : 0;
}

template <typename Values>
void add_coupling(BlockMatrix& A, int pair, bool transposed, const Values& values) {
  if (transposed)
    A.between(pair) += values.transpose();
  else
    A.between(pair) += values;
}

}  // namespace

Vector6 tangent_of_step(const Eigen::Ref<const VectorXd>& step) {
  Vector6 xi = Vector6::Zero();
  xi.segment(first_of(step.size()), step.size()) = step;
  return xi;
}

double residual_of(const PoseEdge& edge, const SE3& T_world_from, const SE3& T_world_to) {
  const SE3 predicted = T_world_from * edge.T_from_to;
  return std::sqrt(edge.precision.kappa * (T_world_to.linear() - predicted.linear()).squaredNorm() +
                   edge.precision.tau *
                       (T_world_to.translation() - predicted.translation()).squaredNorm());
}

TreeFront::TreeFront(FrontGraph graph) : graph_(std::move(graph)) {
  if (graph_.poses < 1) refuse(graph_.self, "it has no poses");
  for (Index k = 0; k < graph_.poses; ++k)
    ids_.push_back({graph_.self, static_cast<KeyframeIndex>(k)});
  const auto usable = [](const PoseEdge& e) {
    const auto& [kappa, tau] = e.precision;
    return e.T_from_to.matrix().allFinite() && kappa > 0.0 && tau > 0.0 &&
           std::isfinite(kappa + tau);
  };
  for (const PoseEdge& e : graph_.edges) {
    if (!usable(e)) refuse(graph_.self, "an edge is not finite with positive precisions");
    const int i = add_node(e.from), j = add_node(e.to);
    if (i == j) refuse(graph_.self, "an edge joins pose " + to_string(e.from) + " with itself");
    edges_.push_back({{i, j, e.T_from_to, e.precision.kappa, e.precision.tau}});
  }
  for (const HeldEdge& h : graph_.held)
    if (!usable(h.edge) || h.edge.end_on(graph_.self).index >= graph_.poses)
      refuse(graph_.self, "an edge to a held pose is not usable");
  for (const VerticalPrior& v : graph_.verticals)
    if (v.pose < 0 || v.pose >= graph_.poses || !v.up.allFinite() || !(v.weight > 0.0))
      refuse(graph_.self, "a vertical prior is not usable");
  followed_ = ids_.size();
  weights_.assign(graph_.edges.size() + graph_.held.size(), 1.0);
}

int TreeFront::add_node(const KeyframeId& id) {
  if (id.robot == graph_.self) {
    if (id.index >= graph_.poses)
      refuse(graph_.self, "pose " + to_string(id) + " of " + std::to_string(graph_.poses));
    return static_cast<int>(id.index);
  }
  const auto [entry, added] = foreign_.try_emplace(id, static_cast<int>(ids_.size()));
  if (added) ids_.push_back(id);
  return entry->second;
}

std::size_t TreeFront::node_of(const KeyframeId& id) const {
  if (id.robot == graph_.self) return id.index;
  return at(foreign_.at(id));
}

void TreeFront::weigh(const std::vector<double>& weights) {
  weights_ = weights;
}

bool TreeFront::stale() const {
  if (linearised_weights_.empty()) return true;
  for (std::size_t k = 0; k < weights_.size(); ++k) {
    const bool told = k < edges_.size() && edges_[k].told >= 0;
    if (!told && differs(weights_[k], linearised_weights_[k])) return true;
  }
  return false;
}

void TreeFront::set_child(RobotId name, TreeSystem system) {
  Child child{.system = std::move(system)};
  std::set<int> seen;
  for (const TreeVariable& v : child.system.variables) {
    child.node.push_back(add_node(v.id));
    if (!seen.insert(child.node.back()).second) refuse(name, "tells a pose twice");
  }
  if (child.system.schur.block() != block()) refuse(name, "tells blocks of another size");
  const auto before = children_.find(name);
  const auto same_pattern = [&](const TreeSystem& x, const TreeSystem& y) {
    return x.pairs == y.pairs && child.node == before->second.node;
  };
  if (before != children_.end() && plan_ && same_pattern(before->second.system, child.system) &&
      child.system.edges.size() == before->second.system.edges.size()) {
    child.pair = std::move(before->second.pair);
    child.transposed = std::move(before->second.transposed);
    child.told = std::move(before->second.told);
  } else {
    plan_.reset();
  }
  children_[name] = std::move(child);
  changed_ = true;
}

void TreeFront::reweigh_child(RobotId name, std::span<const UpLetter::NewWeight> weights) {
  Child& child = children_.at(name);
  for (const auto& [edge, weight] : weights) {
    if (edge >= child.system.edges.size()) refuse(name, "weighs an edge that it did not tell");
    child.system.edges[edge].weight = weight;
    if (child.told[edge] < 0) changed_ = true;
  }
}

// Nodes that robots outside the subtree use, as far as this robot knows.
std::vector<bool> TreeFront::incomplete() const {
  std::vector<std::uint32_t> touched(ids_.size(), 0), of(ids_.size(), 0);
  for (std::size_t v = 0; v < followed_; ++v) touched[v] = 1;
  for (Index k = 0; k < graph_.poses; ++k) of[static_cast<std::size_t>(k)] = 1;
  for (const auto& [index, robots] : graph_.touched_by) of[index] = robots;
  for (const auto& [name, child] : children_)
    for (std::size_t k = 0; k < child.node.size(); ++k) {
      touched[at(child.node[k])] += child.system.variables[k].touched;
      if (child.system.variables[k].of > 0) of[at(child.node[k])] = child.system.variables[k].of;
    }
  std::vector<bool> result(ids_.size());
  for (std::size_t v = 0; v < ids_.size(); ++v) result[v] = of[v] == 0 || touched[v] < of[v];
  return result;
}

void TreeFront::plan() {
  std::vector<NodePair> pairs;
  const auto couple = [&](Index i, Index j) {
    pairs.push_back({static_cast<int>(std::min(i, j)), static_cast<int>(std::max(i, j))});
  };
  for (const Edge& e : edges_) couple(e.measured.i, e.measured.j);
  for (const auto& [name, child] : children_)
    for (const auto& [i, j] : child.system.pairs) couple(child.node[at(i)], child.node[at(j)]);
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  const auto place = [&](Index i, Index j) {
    const NodePair pair{static_cast<int>(std::min(i, j)), static_cast<int>(std::max(i, j))};
    return static_cast<int>(std::lower_bound(pairs.begin(), pairs.end(), pair) - pairs.begin());
  };
  for (Edge& e : edges_) {
    e.pair = place(e.measured.i, e.measured.j);
    e.transposed = e.measured.i > e.measured.j;
  }
  for (auto& [name, child] : children_) {
    child.pair.clear();
    child.transposed.clear();
    for (const auto& [i, j] : child.system.pairs) {
      child.pair.push_back(place(child.node[at(i)], child.node[at(j)]));
      child.transposed.push_back(child.node[at(i)] > child.node[at(j)]);
    }
  }
  std::vector<bool> keep = incomplete();
  if (graph_.root) {
    if (std::find(keep.begin(), keep.end(), true) != keep.end())
      refuse(graph_.self, "the team's robots do not agree on who touches which pose");
    if (graph_.free) keep[static_cast<std::size_t>(graph_.poses / 2)] = true;
  } else {
    std::vector<bool> hidden(keep.size(), false);
    for (Index k = 0; k < graph_.poses; ++k)
      hidden[static_cast<std::size_t>(k)] = !graph_.open.contains(static_cast<KeyframeIndex>(k));
    keep = keep_sparse(std::move(keep), pairs, hidden);
  }
  plan_ = std::make_shared<const EliminationPlan>(std::move(keep), std::move(pairs));
  factor_.emplace(plan_);
  linearised_weights_.clear();
  list_told_edges();
}

void TreeFront::list_told_edges() {
  const std::vector<int>& kept = plan_->place_of_kept();
  told_.clear();
  const auto tell = [&](Index i, Index j, RobotId child, std::size_t edge) {
    if (kept[static_cast<std::size_t>(i)] < 0 || kept[static_cast<std::size_t>(j)] < 0) return -1;
    told_.push_back({child, edge});
    return static_cast<int>(told_.size()) - 1;
  };
  for (std::size_t k = 0; k < edges_.size(); ++k)
    edges_[k].told = tell(edges_[k].measured.i, edges_[k].measured.j, graph_.self, k);
  for (auto& [name, child] : children_) {
    child.told.clear();
    for (std::size_t k = 0; k < child.system.edges.size(); ++k) {
      const auto& [i, j] = child.system.pairs[at(child.system.edges[k].pair)];
      child.told.push_back(tell(child.node[at(i)], child.node[at(j)], name, k));
    }
  }
}

template <int kBlock>
void TreeFront::add_own(std::span<const SE3> poses, Curvature curvature, BlockMatrix& A) const {
  constexpr Index kFirst = first_of(kBlock);
  const auto part = [](const Matrix6& H) { return H.block<kBlock, kBlock>(kFirst, kFirst); };
  const auto weighed = [](BlockEdge e, double weight) {
    e.kappa *= weight;
    e.tau *= weight;
    return e;
  };
  for (std::size_t k = 0; k < edges_.size(); ++k) {
    const Edge& e = edges_[k];
    if (e.told >= 0 || weights_[k] == 0.0) continue;
    const auto i = static_cast<std::size_t>(e.measured.i);
    const auto j = static_cast<std::size_t>(e.measured.j);
    const EdgeModel model =
        model_edge(weighed(e.measured, weights_[k]), poses[i], poses[j], curvature);
    A.diagonal.middleCols<kBlock>(kBlock * e.measured.i) += part(model.H_ii);
    A.diagonal.middleCols<kBlock>(kBlock * e.measured.j) += part(model.H_jj);
    add_coupling(A, e.pair, e.transposed, part(model.H_ij));
  }
  for (std::size_t k = 0; k < graph_.held.size(); ++k) {
    const HeldEdge& h = graph_.held[k];
    const bool from_own = h.edge.from.robot == graph_.self;
    const KeyframeIndex own = h.edge.end_on(graph_.self).index;
    const BlockEdge e =
        weighed({0, 1, h.edge.T_from_to, h.edge.precision.kappa, h.edge.precision.tau},
                weights_[edges_.size() + k]);
    const EdgeModel model = from_own ? model_edge(e, poses[own], h.T_world_other, curvature)
                                     : model_edge(e, h.T_world_other, poses[own], curvature);
    A.diagonal.middleCols<kBlock>(kBlock * Index{own}) += part(from_own ? model.H_ii : model.H_jj);
  }
  if constexpr (kBlock == 6)
    for (const VerticalPrior& v : graph_.verticals)
      A.diagonal.block<3, 3>(0, 6 * v.pose) +=
          model_vertical(v, poses[static_cast<std::size_t>(v.pose)].linear(), curvature).H;
}

void TreeFront::linearise(std::span<const SE3> poses, Curvature curvature) {
  if (!plan_) plan();
  own_ = BlockMatrix::zero(block(), ids_.size(), plan_->pairs().size());
  if (block() == 3)
    add_own<3>(poses, curvature, own_);
  else
    add_own<6>(poses, curvature, own_);
  linearised_weights_ = weights_;
  curvature_ = curvature;
  changed_ = true;
}

void TreeFront::add_child(const Child& child, BlockMatrix& A) const {
  const BlockMatrix& schur = child.system.schur;
  for (std::size_t k = 0; k < child.node.size(); ++k)
    A.at(child.node[k]) += schur.at(static_cast<int>(k));
  for (std::size_t p = 0; p < child.pair.size(); ++p)
    add_coupling(A, child.pair[p], child.transposed[p], schur.between(static_cast<int>(p)));
  const Index B = block();
  const auto part = [B](const Matrix6& H) { return H.block(first_of(B), first_of(B), B, B); };
  for (std::size_t k = 0; k < child.system.edges.size(); ++k) {
    const ToldEdge& e = child.system.edges[k];
    if (child.told[k] >= 0 || e.weight == 0.0F) continue;
    const auto p = at(e.pair);
    const auto& [first, second] = child.system.pairs[p];
    const int i = child.node[at(e.transposed ? second : first)];
    const int j = child.node[at(e.transposed ? first : second)];
    const EdgeModel model = e.model();
    A.at(i) += part(model.H_ii);
    A.at(j) += part(model.H_jj);
    add_coupling(A, child.pair[p], i > j, part(model.H_ij));
  }
}

bool TreeFront::factorise() {
  BlockMatrix A = own_;
  for (const auto& [name, child] : children_) add_child(child, A);
  changed_ = false;
  return factor_->factorise(A);
}

TreeSystem TreeFront::told_system(std::span<const SE3> poses) {
  TreeSystem system{.pairs = plan_->kept_pairs(), .schur = factor_->schur()};
  std::vector<TreeVariable> all(ids_.size());
  for (std::size_t v = 0; v < ids_.size(); ++v) all[v] = {ids_[v], v < followed_ ? 1U : 0U, 0};
  for (Index k = 0; k < graph_.poses; ++k) all[static_cast<std::size_t>(k)].of = 1;
  for (const auto& [index, robots] : graph_.touched_by) all[index].of = robots;
  for (const auto& [name, child] : children_)
    for (std::size_t k = 0; k < child.node.size(); ++k) {
      TreeVariable& v = all[at(child.node[k])];
      v.touched += child.system.variables[k].touched;
      v.of = std::max(v.of, child.system.variables[k].of);
    }
  for (const int node : plan_->kept()) system.variables.push_back(all[at(node)]);
  const std::vector<int>& place = plan_->place_of_kept();
  const auto pair_of = [&](int i, int j) {
    const NodePair pair{std::min(place[at(i)], place[at(j)]), std::max(place[at(i)], place[at(j)])};
    return static_cast<int>(std::lower_bound(system.pairs.begin(), system.pairs.end(), pair) -
                            system.pairs.begin());
  };
  for (ToldWeight& t : told_) {
    ToldEdge edge;
    int i = 0, j = 0;
    if (t.child == graph_.self) {
      const BlockEdge& e = edges_[t.edge].measured;
      i = static_cast<int>(e.i);
      j = static_cast<int>(e.j);
      edge.curvature = curvature_;
      edge.kappa = static_cast<float>(e.kappa);
      edge.tau = static_cast<float>(e.tau);
      edge.present = SinglePose::of(poses[at(i)].inverse() * poses[at(j)]);
      edge.measured = SinglePose::of(e.T_i_j);
    } else {
      const Child& child = children_.at(t.child);
      edge = child.system.edges[t.edge];
      const auto& [first, second] = child.system.pairs[at(edge.pair)];
      i = child.node[at(edge.transposed ? second : first)];
      j = child.node[at(edge.transposed ? first : second)];
    }
    edge.pair = pair_of(i, j);
    edge.transposed = place[at(i)] > place[at(j)];
    edge.weight = t.told = weight_of(t);
    system.edges.push_back(edge);
  }
  return system;
}

float TreeFront::weight_of(const ToldWeight& told) const {
  return told.child == graph_.self ? static_cast<float>(weights_[told.edge])
                                   : children_.at(told.child).system.edges[told.edge].weight;
}

std::vector<UpLetter::NewWeight> TreeFront::told_weights() {
  std::vector<UpLetter::NewWeight> changes;
  for (std::size_t k = 0; k < told_.size(); ++k) {
    const float weight = weight_of(told_[k]);
    if (!differs(weight, told_[k].told)) continue;
    told_[k].told = weight;
    changes.push_back({static_cast<std::uint32_t>(k), weight});
  }
  return changes;
}

void TreeFront::add_slopes(std::span<const SE3> poses, MatrixXd& C) const {
  const Index B = block();
  EdgeModel model;
  const auto subtract = [&](Index node, const Vector6& g) {
    C.middleRows(B * node, B) -= g.segment(first_of(B), B);
  };
  for (std::size_t k = 0; k < edges_.size(); ++k) {
    if (weights_[k] < kRejected) continue;
    BlockEdge e = edges_[k].measured;
    e.kappa *= weights_[k];
    e.tau *= weights_[k];
    slope_edge(e, poses[static_cast<std::size_t>(e.i)], poses[static_cast<std::size_t>(e.j)],
               model);
    subtract(e.i, model.g_i);
    subtract(e.j, model.g_j);
  }
  for (std::size_t k = 0; k < graph_.held.size(); ++k) {
    const HeldEdge& h = graph_.held[k];
    const bool from_own = h.edge.from.robot == graph_.self;
    const KeyframeIndex own = h.edge.end_on(graph_.self).index;
    const double w = weights_[edges_.size() + k];
    if (w < kRejected) continue;
    const BlockEdge e{0, 1, h.edge.T_from_to, w * h.edge.precision.kappa, w * h.edge.precision.tau};
    if (from_own)
      slope_edge(e, poses[own], h.T_world_other, model);
    else
      slope_edge(e, h.T_world_other, poses[own], model);
    subtract(own, from_own ? model.g_i : model.g_j);
  }
  if (B == 6)
    for (const VerticalPrior& v : graph_.verticals)
      C.middleRows<3>(6 * v.pose) -=
          model_vertical(v, poses[static_cast<std::size_t>(v.pose)].linear(),
                         Curvature::kGaussNewton)
              .g;
}

void TreeFront::reduce(std::span<const SE3> poses, const std::map<RobotId, VectorXd>& children) {
  const Index B = block();
  MatrixXd C = MatrixXd::Zero(B * static_cast<Index>(ids_.size()), 1);
  add_slopes(poses, C);
  for (const auto& [name, child] : children_) {
    const VectorXd& rows = children.at(name);
    if (rows.size() != B * static_cast<Index>(child.node.size()))
      refuse(name, "tells a right-hand side of another size than its system");
    for (std::size_t k = 0; k < child.node.size(); ++k)
      C.middleRows(B * child.node[k], B) += rows.segment(B * static_cast<Index>(k), B);
  }
  forwarded_ = std::move(C);
  factor_->forward(forwarded_);
  // Summed over the eliminated rows, not computed as the whole norm minus that of the kept rows.
  // Kept rows can be large while only their sum over the team is small. The rounding error of the
  // difference would then appear as a predicted decrease.
  decrement_ = 0.0;
  const std::vector<int>& place = plan_->place_of_kept();
  for (std::size_t v = 0; v < place.size(); ++v)
    if (place[v] < 0)
      decrement_ += forwarded_.middleRows(B * static_cast<Index>(v), B).squaredNorm();
}

VectorXd TreeFront::reduced() const {
  const Index B = block();
  const std::vector<int>& kept = plan_->kept();
  VectorXd rows(B * static_cast<Index>(kept.size()));
  for (std::size_t k = 0; k < kept.size(); ++k)
    rows.segment(B * static_cast<Index>(k), B) = forwarded_.middleRows(B * kept[k], B);
  return rows;
}

// The position of the one remaining pose is held, and its rotation, except for its tilt if
// verticals determine that. A common rotation of the team about the vertical costs nothing, so the
// softest direction is left out.
TreeFront::RootStep TreeFront::solve_root(bool upright) const {
  RootStep result{VectorXd::Zero(block() * static_cast<Index>(plan_->kept().size()))};
  if (!upright || result.kept.size() != 6) return result;
  const Eigen::Vector3d c = reduced().head<3>();
  const Eigen::Matrix3d S = factor_->schur().at(0).topLeftCorner<3, 3>();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> turns(S);
  const Eigen::Matrix<double, 3, 2> tilts = turns.eigenvectors().rightCols<2>();
  const Eigen::Vector2d stiffness = turns.eigenvalues().tail<2>();
  if (!(stiffness.minCoeff() > 0.0)) return result;
  const Eigen::Vector2d along = tilts.transpose() * c;
  const Eigen::Vector2d step = along.cwiseQuotient(stiffness);
  result.decrement = along.dot(step);
  result.kept.head<3>() = tilts * step;
  return result;
}

MatrixXd TreeFront::substitute_back(const VectorXd& kept) const {
  const Index B = block();
  if (kept.size() != B * static_cast<Index>(plan_->kept().size()))
    refuse(graph_.self, "is told a step of another size");
  MatrixXd X = forwarded_;
  for (std::size_t k = 0; k < plan_->kept().size(); ++k)
    X.middleRows(B * plan_->kept()[k], B) = kept.segment(B * static_cast<Index>(k), B);
  factor_->backward(X);
  return X.reshaped(B, static_cast<Index>(ids_.size()));
}

VectorXd TreeFront::step_of_child(RobotId name, const MatrixXd& steps) const {
  const Child& child = children_.at(name);
  VectorXd step(block() * static_cast<Index>(child.node.size()));
  for (std::size_t k = 0; k < child.node.size(); ++k)
    step.segment(block() * static_cast<Index>(k), block()) = steps.col(child.node[k]);
  return step;
}

double TreeFront::cost(std::span<const SE3> poses) const {
  double cost = 0.0;
  for (std::size_t k = 0; k < edges_.size(); ++k) {
    if (weights_[k] < kRejected) continue;
    const Edge& e = edges_[k];
    const double r = residual_of(graph_.edges[k], poses[static_cast<std::size_t>(e.measured.i)],
                                 poses[static_cast<std::size_t>(e.measured.j)]);
    cost += weights_[k] * r * r;
  }
  for (std::size_t k = 0; k < graph_.held.size(); ++k) {
    const HeldEdge& h = graph_.held[k];
    const double w = weights_[edges_.size() + k];
    const SE3& own = poses[h.edge.end_on(graph_.self).index];
    const bool from_own = h.edge.from.robot == graph_.self;
    const double r =
        residual_of(h.edge, from_own ? own : h.T_world_other, from_own ? h.T_world_other : own);
    if (w >= kRejected) cost += w * r * r;
  }
  if (block() == 6)
    for (const VerticalPrior& v : graph_.verticals)
      cost += model_vertical(v, poses[static_cast<std::size_t>(v.pose)].linear(),
                             Curvature::kGaussNewton)
                  .cost;
  return cost;
}

}  // namespace km
