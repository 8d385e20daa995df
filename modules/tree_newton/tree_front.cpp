#include "modules/tree_newton/tree_front.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "modules/tree_newton/sparse_choice.hpp"

namespace km {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Ratio of weights from which on old second derivatives mislead a step: the stiffness of an edge is
// half or twice its correct value. Weights below kNoWeight are negligible compared to odometry.
constexpr double kWeightRatio = 2.0;
constexpr double kDecidedRatio = 1.01;  // for covariances too
constexpr double kNoWeight = 0.02;
// An edge with a weight below this is rejected. It has no cost and no gradient; its stiffness only
// keeps the system regular.
constexpr double kRejected = 1e-6;
// Damping of singular equations, relative to their largest entry: above the rounding errors of a
// factorisation.
constexpr double kDamping = 1e-9;

[[noreturn]] void refuse(RobotId robot, const std::string& what) {
  throw std::invalid_argument("TreeFront of robot " + std::to_string(robot) + ": " + what);
}

bool differs(double weight, double before, bool decided) {
  const auto [less, more] = std::minmax(weight, before);
  return more > kNoWeight && more > (decided ? kDecidedRatio : kWeightRatio) * less;
}

std::size_t at(Index k) {
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

Precision weighed(const Precision& precision, double weight) {
  return {weight * precision.kappa, weight * precision.tau};
}

bool is_usable(const PoseEdge& e) {
  const auto& [kappa, tau] = e.precision;
  return e.T_from_to.matrix().allFinite() && kappa > 0.0 && tau > 0.0 && std::isfinite(kappa + tau);
}

// Standard deviations of the variables whose covariances are `triangles`, one column each, times
// the square root of the unit of a correlation.
MatrixXd units_of_correlations(std::span<const float> triangles, Index block) {
  const Index size = block * (block + 1) / 2;
  MatrixXd units(block, static_cast<Index>(triangles.size()) / size);
  for (Index k = 0; k < units.cols(); ++k)
    for (Index row = 0, next = k * size; row < block; next += block - row, ++row)
      units(row, k) = std::sqrt(TreeInverse::kCorrelation *
                                std::max(0.0, static_cast<double>(triangles[at(next)])));
  return units;
}

std::int16_t correlation_of(double covariance, double unit) {
  constexpr double kMost = 1.0 / TreeInverse::kCorrelation;
  if (!(unit > 0.0)) return 0;
  return static_cast<std::int16_t>(std::lround(std::clamp(covariance / unit, -kMost, kMost)));
}

NodePair ordered(int i, int j) {
  return {std::min(i, j), std::max(i, j)};
}

int index_of(const std::vector<NodePair>& pairs, const NodePair& pair) {
  return static_cast<int>(std::lower_bound(pairs.begin(), pairs.end(), pair) - pairs.begin());
}

}  // namespace

Vector6 tangent_of_step(const Eigen::Ref<const VectorXd>& step) {
  Vector6 xi = Vector6::Zero();
  xi.segment(first_of(step.size()), step.size()) = step;
  return xi;
}

TreeFront::TreeFront(FrontGraph graph) : graph_(std::move(graph)) {
  if (graph_.poses < 1) refuse(graph_.self, "it has no poses");
  for (Index k = 0; k < graph_.poses; ++k)
    ids_.push_back({graph_.self, static_cast<KeyframeIndex>(k)});
  for (const PoseEdge& e : graph_.edges) slots_.push_back(slot_of(e));
  for (const VerticalPrior& v : graph_.verticals)
    if (v.pose < 0 || v.pose >= graph_.poses || !v.up.allFinite() || !(v.weight > 0.0))
      refuse(graph_.self, "a vertical prior is not usable");
  followed_ = ids_.size();
  weights_.assign(graph_.edges.size(), 1.0);
}

TreeFront::EdgeSlot TreeFront::slot_of(const PoseEdge& edge) {
  if (!is_usable(edge)) refuse(graph_.self, "an edge is not finite with positive precisions");
  if (edge.from == edge.to)
    refuse(graph_.self, "an edge joins pose " + to_string(edge.from) + " with itself");
  EdgeSlot slot;
  const auto node = [&](const KeyframeId& id) {
    return graph_.held.contains(id) ? -1 : add_node(id);
  };
  slot.i = node(edge.from);
  slot.j = node(edge.to);
  if (slot.i < 0 && slot.j < 0) refuse(graph_.self, "an edge joins two held poses");
  return slot;
}

const SE3& TreeFront::pose_of(int node, const KeyframeId& id, std::span<const SE3> poses) const {
  return node < 0 ? graph_.held.at(id) : poses[at(node)];
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

std::optional<std::size_t> TreeFront::origin_node() const {
  if (!graph_.origin) return std::nullopt;
  if (graph_.origin->robot == graph_.self)
    return graph_.origin->index < graph_.poses ? std::optional(std::size_t{graph_.origin->index})
                                               : std::nullopt;
  const auto foreign = foreign_.find(*graph_.origin);
  return foreign == foreign_.end() ? std::nullopt : std::optional(at(foreign->second));
}

void TreeFront::weigh(const std::vector<double>& weights, bool decided) {
  weights_ = weights;
  decided_ = decided;
}

bool TreeFront::stale() const {
  if (linearised_weights_.empty()) return true;
  for (std::size_t k = 0; k < weights_.size(); ++k)
    if (slots_[k].sent < 0 && differs(weights_[k], linearised_weights_[k], decided_)) return true;
  return false;
}

void TreeFront::set_child(RobotId name, TreeSystem system) {
  Child child{.system = std::move(system)};
  std::set<int> seen;
  for (const TreeVariable& v : child.system.variables) {
    child.node.push_back(add_node(v.id));
    if (!seen.insert(child.node.back()).second) refuse(name, "sends a pose twice");
  }
  if (child.system.schur.block() != block()) refuse(name, "sends blocks of another size");
  const auto before = children_.find(name);
  const auto same_pattern = [&](const TreeSystem& x, const TreeSystem& y) {
    return x.pairs == y.pairs && child.node == before->second.node;
  };
  if (before != children_.end() && plan_ && same_pattern(before->second.system, child.system) &&
      child.system.edges.size() == before->second.system.edges.size()) {
    child.pair = std::move(before->second.pair);
    child.transposed = std::move(before->second.transposed);
    child.sent = std::move(before->second.sent);
  } else {
    plan_.reset();
  }
  children_[name] = std::move(child);
  changed_ = true;
}

void TreeFront::reweigh_child(RobotId name, std::span<const NewWeight> weights) {
  Child& child = children_.at(name);
  for (const auto& [edge, weight] : weights) {
    if (edge >= child.system.edges.size()) refuse(name, "weighs an edge that it did not send");
    child.system.edges[edge].weight = weight;
    if (child.sent[edge] < 0) changed_ = true;
  }
}

// All nodes, with the numbers of robots that use them, as far as this robot knows.
std::vector<TreeVariable> TreeFront::variables() const {
  std::vector<TreeVariable> all(ids_.size());
  for (std::size_t v = 0; v < ids_.size(); ++v) all[v] = {ids_[v], v < followed_ ? 1U : 0U, 0};
  for (Index k = 0; k < graph_.poses; ++k) all[at(k)].of = 1;
  for (const auto& [index, robots] : graph_.touched_by) all[index].of = robots;
  for (const auto& [name, child] : children_)
    for (std::size_t k = 0; k < child.node.size(); ++k) {
      TreeVariable& v = all[at(child.node[k])];
      v.touched += child.system.variables[k].touched;
      v.of = std::max(v.of, child.system.variables[k].of);
    }
  return all;
}

void TreeFront::plan() {
  std::vector<NodePair> pairs;
  for (const EdgeSlot& p : slots_)
    if (p.i >= 0 && p.j >= 0) pairs.push_back(ordered(p.i, p.j));
  for (const auto& [name, child] : children_)
    for (const auto& [i, j] : child.system.pairs)
      pairs.push_back(ordered(child.node[at(i)], child.node[at(j)]));
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  place_pairs(pairs);
  std::vector<bool> keep = kept_nodes(pairs);
  plan_ = std::make_shared<const EliminationPlan>(std::move(keep), std::move(pairs));
  factor_.emplace(plan_);
  linearised_weights_.clear();
  list_sent_edges();
}

void TreeFront::place_pairs(const std::vector<NodePair>& pairs) {
  for (EdgeSlot& p : slots_) {
    if (p.i < 0 || p.j < 0) continue;
    p.pair = index_of(pairs, ordered(p.i, p.j));
    p.transposed = p.i > p.j;
  }
  for (auto& [name, child] : children_) {
    child.pair.clear();
    child.transposed.clear();
    for (const auto& [first, second] : child.system.pairs) {
      const int i = child.node[at(first)], j = child.node[at(second)];
      child.pair.push_back(index_of(pairs, ordered(i, j)));
      child.transposed.push_back(i > j);
    }
  }
}

// Keeps the nodes that robots outside the subtree use, as far as this robot knows. Also keeps poses
// that may be sent, if their elimination would add more couplings than it removes.
std::vector<bool> TreeFront::kept_nodes(const std::vector<NodePair>& pairs) const {
  std::vector<bool> keep;
  for (const TreeVariable& v : variables()) keep.push_back(v.of == 0 || v.touched < v.of);
  if (graph_.root) {
    if (std::find(keep.begin(), keep.end(), true) != keep.end())
      refuse(graph_.self, "the robots of the team do not agree on the robots that use a pose");
    if (graph_.free) keep[at(graph_.poses / 2)] = true;
    return keep;
  }
  if (const auto origin = origin_node()) keep[*origin] = true;
  std::vector<bool> hidden(keep.size(), false);
  for (Index k = 0; k < graph_.poses; ++k)
    hidden[at(k)] = !graph_.open.contains(static_cast<KeyframeIndex>(k));
  return keep_sparse(std::move(keep), pairs, hidden);
}

void TreeFront::list_sent_edges() {
  const std::vector<int>& kept = plan_->place_of_kept();
  sent_.clear();
  const auto send = [&](int i, int j, RobotId child, std::size_t edge) {
    if (i < 0 || j < 0 || kept[at(i)] < 0 || kept[at(j)] < 0) return -1;
    sent_.push_back({child, edge});
    return static_cast<int>(sent_.size()) - 1;
  };
  for (std::size_t k = 0; k < slots_.size(); ++k)
    slots_[k].sent = send(slots_[k].i, slots_[k].j, graph_.self, k);
  for (auto& [name, child] : children_) {
    child.sent.clear();
    for (std::size_t k = 0; k < child.system.edges.size(); ++k) {
      const auto& [i, j] = child.system.pairs[at(child.system.edges[k].pair)];
      child.sent.push_back(send(child.node[at(i)], child.node[at(j)], name, k));
    }
  }
}

template <int kBlock>
void TreeFront::add_own(std::span<const SE3> poses, Curvature curvature, BlockMatrix& A) const {
  constexpr Index kFirst = first_of(kBlock);
  const auto part = [](const Matrix6& H) { return H.block<kBlock, kBlock>(kFirst, kFirst); };
  for (std::size_t k = 0; k < slots_.size(); ++k) {
    const EdgeSlot& p = slots_[k];
    if (p.sent >= 0 || weights_[k] == 0.0) continue;
    const PoseEdge& e = graph_.edges[k];
    const EdgeModel model =
        model_edge(e.T_from_to, weighed(e.precision, weights_[k]), pose_of(p.i, e.from, poses),
                   pose_of(p.j, e.to, poses), curvature);
    if (p.i >= 0) A.diagonal.middleCols<kBlock>(kBlock * p.i) += part(model.H_ii);
    if (p.j >= 0) A.diagonal.middleCols<kBlock>(kBlock * p.j) += part(model.H_jj);
    if (p.pair >= 0) add_coupling(A, p.pair, p.transposed, part(model.H_ij));
  }
  if constexpr (kBlock == 6)
    for (const VerticalPrior& v : graph_.verticals)
      A.diagonal.block<3, 3>(0, 6 * v.pose) +=
          model_vertical(v, poses[at(v.pose)].linear(), curvature).H;
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
    const SentEdge& e = child.system.edges[k];
    if (child.sent[k] >= 0 || e.weight == 0.0F) continue;
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

// The second derivatives of own edges and of the children.
BlockMatrix TreeFront::assembled() const {
  BlockMatrix A = own_;
  for (const auto& [name, child] : children_) add_child(child, A);
  return A;
}

bool TreeFront::factorise() {
  changed_ = damped_ = false;
  return factor_->factorise(assembled());
}

bool TreeFront::factorise_damped() {
  changed_ = false;
  damped_ = true;
  BlockMatrix A = assembled();
  const double damping = kDamping * A.diagonal.cwiseAbs().maxCoeff();
  for (int node = 0; node < static_cast<int>(ids_.size()); ++node)
    A.at(node).diagonal().array() += damping;
  return factor_->factorise(A);
}

TreeSystem TreeFront::system_for_parent(std::span<const SE3> poses) {
  TreeSystem system{.pairs = plan_->kept_pairs(), .schur = factor_->schur()};
  const std::vector<TreeVariable> all = variables();
  for (const int node : plan_->kept()) system.variables.push_back(all[at(node)]);
  for (SentWeight& s : sent_) {
    system.edges.push_back(sent_edge(s, poses, system.pairs));
    s.sent = system.edges.back().weight;
  }
  return system;
}

SentEdge TreeFront::sent_edge(const SentWeight& sent, std::span<const SE3> poses,
                              const std::vector<NodePair>& pairs) const {
  SentEdge edge;
  int i = 0, j = 0;
  if (sent.child == graph_.self) {
    const PoseEdge& e = graph_.edges[sent.edge];
    i = slots_[sent.edge].i;
    j = slots_[sent.edge].j;
    edge.curvature = curvature_;
    edge.kappa = static_cast<float>(e.precision.kappa);
    edge.tau = static_cast<float>(e.precision.tau);
    edge.present = SinglePose::of(poses[at(i)].inverse() * poses[at(j)]);
    edge.measured = SinglePose::of(e.T_from_to);
  } else {
    const Child& child = children_.at(sent.child);
    edge = child.system.edges[sent.edge];
    const auto& [first, second] = child.system.pairs[at(edge.pair)];
    i = child.node[at(edge.transposed ? second : first)];
    j = child.node[at(edge.transposed ? first : second)];
  }
  const std::vector<int>& place = plan_->place_of_kept();
  edge.pair = index_of(pairs, ordered(place[at(i)], place[at(j)]));
  edge.transposed = place[at(i)] > place[at(j)];
  edge.weight = weight_of(sent);
  return edge;
}

float TreeFront::weight_of(const SentWeight& sent) const {
  return sent.child == graph_.self ? static_cast<float>(weights_[sent.edge])
                                   : children_.at(sent.child).system.edges[sent.edge].weight;
}

std::vector<NewWeight> TreeFront::changed_weights() {
  std::vector<NewWeight> changes;
  for (std::size_t k = 0; k < sent_.size(); ++k) {
    const float weight = weight_of(sent_[k]);
    if (!differs(weight, sent_[k].sent, decided_)) continue;
    sent_[k].sent = weight;
    changes.push_back({static_cast<std::uint32_t>(k), weight});
  }
  return changes;
}

// Negative gradients of own edges and verticals.
MatrixXd TreeFront::slopes(std::span<const SE3> poses) const {
  const Index B = block();
  MatrixXd rows = MatrixXd::Zero(B * static_cast<Index>(ids_.size()), 1);
  EdgeModel model;
  const auto subtract = [&](int node, const Vector6& g) {
    if (node >= 0) rows.middleRows(B * node, B) -= g.segment(first_of(B), B);
  };
  for (std::size_t k = 0; k < slots_.size(); ++k) {
    if (weights_[k] < kRejected) continue;
    const EdgeSlot& p = slots_[k];
    const PoseEdge& e = graph_.edges[k];
    set_cost_and_gradient(e.T_from_to, weighed(e.precision, weights_[k]),
                          pose_of(p.i, e.from, poses), pose_of(p.j, e.to, poses), model);
    subtract(p.i, model.g_i);
    subtract(p.j, model.g_j);
  }
  if (B == 6)
    for (const VerticalPrior& v : graph_.verticals)
      rows.middleRows<3>(6 * v.pose) -=
          model_vertical(v, poses[at(v.pose)].linear(), Curvature::kGaussNewton).g;
  return rows;
}

void TreeFront::reduce(std::span<const SE3> poses, const std::map<RobotId, VectorXd>& children) {
  const Index B = block();
  MatrixXd rows = slopes(poses);
  for (const auto& [name, of_child] : children) {
    const Child& child = children_.at(name);
    if (of_child.size() != B * static_cast<Index>(child.node.size()))
      refuse(name, "sends a right-hand side of another size than its system");
    for (std::size_t k = 0; k < child.node.size(); ++k)
      rows.middleRows(B * child.node[k], B) += of_child.segment(B * static_cast<Index>(k), B);
  }
  forwarded_ = std::move(rows);
  factor_->forward(forwarded_);
}

VectorXd TreeFront::reduced() const {
  const Index B = block();
  const std::vector<int>& kept = plan_->kept();
  VectorXd rows(B * static_cast<Index>(kept.size()));
  for (std::size_t k = 0; k < kept.size(); ++k)
    rows.segment(B * static_cast<Index>(k), B) = forwarded_.middleRows(B * kept[k], B);
  return rows;
}

// Summed over the eliminated rows, not computed as the whole norm minus that of the kept rows. Kept
// rows can be large while only their sum over the team is small. The rounding error of the
// difference would then appear as a predicted decrease.
double TreeFront::decrement() const {
  double sum = 0.0;
  const std::vector<int>& place = plan_->place_of_kept();
  for (std::size_t v = 0; v < place.size(); ++v)
    if (place[v] < 0)
      sum += forwarded_.middleRows(block() * static_cast<Index>(v), block()).squaredNorm();
  return sum;
}

// The root holds the position and rotation of the one remaining pose, or only its position and
// heading if verticals determine its tilt. A common rotation of the team about the vertical costs
// nothing, so the softest direction of rotation is the heading and is left out.
std::optional<TreeFront::Tilts> TreeFront::tilts_of(const BlockMatrix& held, bool upright) {
  if (!upright || held.diagonal.cols() != 6) return std::nullopt;
  const Eigen::Matrix3d S = held.at(0).topLeftCorner<3, 3>();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> turns(S);
  const Tilts tilts{turns.eigenvectors().rightCols<2>(), turns.eigenvalues().tail<2>()};
  return tilts.stiffness.minCoeff() > 0.0 ? std::optional(tilts) : std::nullopt;
}

TreeFront::RootStep TreeFront::solve_root(bool upright) const {
  RootStep result{VectorXd::Zero(block() * static_cast<Index>(plan_->kept().size()))};
  const auto tilts = tilts_of(factor_->schur(), upright);
  if (!tilts) return result;
  const Eigen::Vector2d along = tilts->directions.transpose() * reduced().head<3>();
  const Eigen::Vector2d step = along.cwiseQuotient(tilts->stiffness);
  result.decrement = along.dot(step);
  result.kept.head<3>() = tilts->directions * step;
  return result;
}

MatrixXd TreeFront::substitute_back(const VectorXd& kept) const {
  const Index B = block();
  if (kept.size() != B * static_cast<Index>(plan_->kept().size()))
    refuse(graph_.self, "receives a step of another size");
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

BlockMatrix TreeFront::inverse(const BlockMatrix& kept) const {
  return factor_->selected_inverse(kept);
}

// The factorisation for Newton steps holds a pose in the middle of the graph: rounds that reuse
// earlier second derivatives then converge faster. Covariances need a factorisation with the origin
// held.
std::optional<BlockMatrix> TreeFront::inverse_about_origin(bool upright) {
  if (!graph_.free) return factor_->selected_inverse(BlockMatrix::zero(block(), 0, 0));
  std::vector<bool> keep(ids_.size(), false);
  keep[origin_node().value_or(at(graph_.poses / 2))] = true;
  factor_.reset();
  FrontalCholesky factor(std::make_shared<const EliminationPlan>(std::move(keep), plan_->pairs()));
  if (!factor.factorise(assembled())) return std::nullopt;
  BlockMatrix held = BlockMatrix::zero(block(), 1, 0);
  if (const auto tilts = tilts_of(factor.schur(), upright))
    held.at(0).topLeftCorner<3, 3>() = tilts->directions *
                                       tilts->stiffness.cwiseInverse().asDiagonal() *
                                       tilts->directions.transpose();
  return factor.selected_inverse(held);
}

// Leaves out couplings that are zero in the Schur complement of the child. They are not part of its
// factor, so the child does not need them.
TreeInverse TreeFront::inverse_of_child(RobotId name, const BlockMatrix& inverse) const {
  const Child& child = children_.at(name);
  TreeInverse sent;
  for (const int node : child.node)
    for (Index c = 0; c < block(); ++c)
      for (Index row = c; row < block(); ++row)
        sent.diagonal.push_back(static_cast<float>(inverse.at(node)(row, c)));
  const MatrixXd units = units_of_correlations(sent.diagonal, block());
  for (std::size_t p = 0; p < child.pair.size(); ++p) {
    if (!is_sent(child.system.schur, child.system.pairs[p], static_cast<int>(p))) continue;
    MatrixXd values = inverse.between(child.pair[p]);
    if (child.transposed[p]) values.transposeInPlace();
    const auto& [i, j] = child.system.pairs[p];
    for (Index c = 0; c < block(); ++c)
      for (Index row = 0; row < block(); ++row)
        sent.correlations.push_back(correlation_of(values(row, c), units(row, i) * units(c, j)));
  }
  return sent;
}

BlockMatrix TreeFront::inverse_from_parent(const TreeInverse& sent) const {
  const std::vector<NodePair>& pairs = plan_->kept_pairs();
  const Index B = block();
  BlockMatrix inverse = BlockMatrix::zero(B, plan_->kept().size(), pairs.size());
  std::vector<int> coupled;
  for (int p = 0; p < static_cast<int>(pairs.size()); ++p)
    if (is_sent(factor_->schur(), pairs[at(p)], p)) coupled.push_back(p);
  if (sent.diagonal.size() != plan_->kept().size() * at(B * (B + 1) / 2) ||
      sent.correlations.size() != coupled.size() * at(B * B))
    refuse(graph_.self, "receives an inverse of another size");
  auto variance = sent.diagonal.begin();
  for (std::size_t k = 0; k < plan_->kept().size(); ++k) {
    auto values = inverse.at(static_cast<int>(k));
    for (Index c = 0; c < B; ++c)
      for (Index row = c; row < B; ++row) values(row, c) = values(c, row) = *variance++;
  }
  const MatrixXd units = units_of_correlations(sent.diagonal, B);
  auto correlation = sent.correlations.begin();
  for (const int p : coupled) {
    auto values = inverse.between(p);
    const auto& [i, j] = pairs[at(p)];
    for (Index c = 0; c < B; ++c)
      for (Index row = 0; row < B; ++row)
        values(row, c) = *correlation++ * units(row, i) * units(c, j);
  }
  return inverse;
}

double TreeFront::cost(std::span<const SE3> poses) const {
  double cost = 0.0;
  for (std::size_t k = 0; k < slots_.size(); ++k) {
    if (weights_[k] < kRejected) continue;
    const EdgeSlot& p = slots_[k];
    const PoseEdge& e = graph_.edges[k];
    const double r = residual_of(e, pose_of(p.i, e.from, poses), pose_of(p.j, e.to, poses));
    cost += weights_[k] * r * r;
  }
  if (block() == 6)
    for (const VerticalPrior& v : graph_.verticals)
      cost += model_vertical(v, poses[at(v.pose)].linear(), Curvature::kGaussNewton).cost;
  return cost;
}

}  // namespace km
