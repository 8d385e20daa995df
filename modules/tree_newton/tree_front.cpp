#include "modules/tree_newton/tree_front.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "modules/tree_newton/sparse_choice.hpp"

namespace km {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Damping of singular equations, relative to their largest entry: above the rounding errors of a
// factorisation.
constexpr double kDamping = 1e-9;

[[noreturn]] void refuse(RobotId robot, const std::string& what) {
  throw std::invalid_argument("TreeFront of robot " + std::to_string(robot) + ": " + what);
}

// The rows of these nodes, one below the other.
VectorXd rows_of(const Eigen::Ref<const VectorXd>& X, Index block, std::span<const int> nodes) {
  VectorXd rows(block * static_cast<Index>(nodes.size()));
  for (Index k = 0; k < std::ssize(nodes); ++k)
    rows.segment(block * k, block) = X.segment(block * nodes[at(k)], block);
  return rows;
}

// Directions in which a pose with held position may turn, and their stiffness.
struct Tilts {
  Eigen::Matrix<double, 3, 2> directions;
  Eigen::Vector2d stiffness;
};

// The root holds the position and rotation of the one remaining pose, or only its position and
// heading if verticals determine its tilt. A common rotation of the team about the vertical costs
// nothing, so the softest direction of rotation is the heading and is left out.
std::optional<Tilts> tilts_of(const BlockMatrix& held, bool upright) {
  if (!upright || held.diagonal.cols() != 6) return std::nullopt;
  const Eigen::Matrix3d S = held.at(0).topLeftCorner<3, 3>();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> turns(S);
  const Tilts tilts{turns.eigenvectors().rightCols<2>(), turns.eigenvalues().tail<2>()};
  return tilts.stiffness.minCoeff() > 0.0 ? std::optional(tilts) : std::nullopt;
}

// The inverse for errors relative to the pose that is kept, if one is.
BlockMatrix inverse_about_kept(const FrontalCholesky& factor, bool upright) {
  const BlockMatrix& schur = factor.schur();
  BlockMatrix held = BlockMatrix::zero(schur.block(), at(schur.diagonal.cols() / schur.block()), 0);
  if (const auto tilts = tilts_of(schur, upright))
    held.at(0).topLeftCorner<3, 3>() = tilts->directions *
                                       tilts->stiffness.cwiseInverse().asDiagonal() *
                                       tilts->directions.transpose();
  return factor.selected_inverse(held);
}

}  // namespace

EdgeSlot TreeFront::Child::slot_of(const SentEdge& edge) const {
  EdgeSlot slot = pairs[at(edge.pair)];
  if (edge.transposed) std::swap(slot.i, slot.j);
  return slot;
}

void TreeFront::update_child(RobotId name, std::optional<TreeSystem> system,
                             std::span<const NewWeight> weights) {
  if (system) {
    Child child{.system = std::move(*system)};
    std::set<int> seen;
    for (const TreeVariable& v : child.system.variables) {
      child.node.push_back(own_.add_node(v.id));
      if (!seen.insert(child.node.back()).second) refuse(name, "sends a pose twice");
    }
    if (child.system.schur.block() != own_.block()) refuse(name, "sends blocks of another size");
    for (const auto& [first, second] : child.system.pairs)
      child.pairs.push_back({child.node[at(first)], child.node[at(second)]});
    const auto same_place = [](const SentEdge& x, const SentEdge& y) {
      return x.pair == y.pair && x.transposed == y.transposed;
    };
    const auto before = children_.find(name);
    if (before != children_.end() && plan_ && before->second.system.pairs == child.system.pairs &&
        before->second.node == child.node &&
        std::ranges::equal(before->second.system.edges, child.system.edges, same_place)) {
      child.pairs = std::move(before->second.pairs);
    } else {
      plan_.reset();
      own_.forget_derivatives();
    }
    children_[name] = std::move(child);
    changed_ = true;
  }
  Child& child = children_.at(name);
  for (const auto& [number, weight] : weights) {
    if (number >= child.system.edges.size()) refuse(name, "weighs an edge that it did not send");
    SentEdge& edge = child.system.edges[number];
    edge.weight = weight;
    if (!child.pairs[at(edge.pair)].sent) changed_ = true;
  }
}

// All nodes, with the numbers of robots that use them, as far as this robot knows.
std::vector<TreeVariable> TreeFront::variables() const {
  std::vector<TreeVariable> all;
  for (const KeyframeId& id : own_.nodes()) all.push_back({id, all.size() < followed_.size(), 0});
  for (Index k = 0; k < own_.graph().poses; ++k) all[at(k)].of = 1;
  for (const auto& [index, robots] : own_.graph().touched_by) all[index].of = robots;
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
  const auto add = [&](std::span<const EdgeSlot> slots) {
    for (const EdgeSlot& slot : slots)
      if (slot.couples()) pairs.push_back(ordered(slot.i, slot.j));
  };
  add(own_.slots());
  for (const auto& [name, child] : children_) add(child.pairs);
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  std::vector<bool> keep = kept_nodes(pairs);
  plan_ = std::make_shared<const EliminationPlan>(std::move(keep), std::move(pairs));
  factor_.emplace(plan_);
  own_.forget_derivatives();
  list_sent_edges();
}

// Keeps the nodes that robots outside the subtree use, as far as this robot knows. Also keeps poses
// that may be sent, if their elimination would add more couplings than it removes.
std::vector<bool> TreeFront::kept_nodes(const std::vector<NodePair>& pairs) const {
  const FrontGraph& graph = own_.graph();
  std::vector<bool> keep;
  for (const TreeVariable& v : variables()) keep.push_back(v.of == 0 || v.touched < v.of);
  if (graph.root) {
    if (std::find(keep.begin(), keep.end(), true) != keep.end())
      refuse(graph.self, "the robots of the team do not agree on the robots that use a pose");
    if (graph.free) keep[at(graph.poses / 2)] = true;
    return keep;
  }
  if (const auto origin = graph.origin ? own_.find(*graph.origin) : std::nullopt)
    keep[*origin] = true;
  std::vector<bool> hidden(keep.size(), false);
  for (Index k = 0; k < graph.poses; ++k)
    hidden[at(k)] = !graph.open.contains(static_cast<KeyframeIndex>(k));
  return keep_sparse(std::move(keep), pairs, hidden);
}

void TreeFront::list_sent_edges() {
  const std::vector<int>& kept = plan_->place_of_kept();
  const auto place = [&](std::span<EdgeSlot> slots) {
    for (EdgeSlot& slot : slots) {
      if (!slot.couples()) continue;
      slot.pair = index_of(plan_->pairs(), slot.i, slot.j);
      slot.sent = kept[at(slot.i)] >= 0 && kept[at(slot.j)] >= 0;
    }
  };
  place(own_.slots());
  for (auto& [name, child] : children_) place(child.pairs);
  sent_.clear();
  for (std::size_t k = 0; k < own_.slots().size(); ++k)
    if (own_.slots()[k].sent) sent_.push_back({own_.graph().self, k});
  for (const auto& [name, child] : children_)
    for (std::size_t k = 0; k < child.system.edges.size(); ++k)
      if (child.slot_of(child.system.edges[k]).sent) sent_.push_back({name, k});
}

void TreeFront::linearise(std::span<const SE3> poses, Curvature curvature) {
  if (!plan_) plan();
  own_.linearise(poses, curvature, plan_->pairs().size());
  changed_ = true;
}

void TreeFront::add_child(const Child& child, BlockMatrix& A) const {
  const BlockMatrix& schur = child.system.schur;
  for (std::size_t k = 0; k < child.node.size(); ++k)
    A.at(child.node[k]) += schur.at(static_cast<int>(k));
  for (std::size_t p = 0; p < child.pairs.size(); ++p)
    A.add(child.pairs[p].pair, child.pairs[p].i > child.pairs[p].j,
          schur.between(static_cast<int>(p)));
  const Index B = own_.block(), first = first_row_of(B);
  const auto part = [=](const Matrix6& H) { return H.block(first, first, B, B); };
  for (const SentEdge& e : child.system.edges) {
    const EdgeSlot slot = child.slot_of(e);
    if (slot.sent || e.weight == 0.0F) continue;
    const EdgeModel model = e.model();
    A.at(slot.i) += part(model.H_ii);
    A.at(slot.j) += part(model.H_jj);
    A.add(slot.pair, slot.i > slot.j, part(model.H_ij));
  }
}

// The second derivatives of own edges and of the children.
BlockMatrix TreeFront::assembled() const {
  BlockMatrix A = own_.second_derivatives();
  for (const auto& [name, child] : children_) add_child(child, A);
  return A;
}

bool TreeFront::factorise(bool damped) {
  changed_ = false;
  damped_ = damped;
  BlockMatrix A = assembled();
  if (damped) {
    const double damping = kDamping * A.diagonal.cwiseAbs().maxCoeff();
    for (int node = 0; node < plan_->nodes(); ++node) A.at(node).diagonal().array() += damping;
  }
  return factor_->factorise(A);
}

TreeSystem TreeFront::system_for_parent(std::span<const SE3> poses) {
  TreeSystem system{.pairs = plan_->kept_pairs(), .schur = factor_->schur()};
  const std::vector<TreeVariable> all = variables();
  for (const int node : plan_->kept()) system.variables.push_back(all[at(node)]);
  for (SentWeight& s : sent_) {
    system.edges.push_back(sent_edge(s, poses));
    s.sent = system.edges.back().weight;
  }
  return system;
}

SentEdge TreeFront::sent_edge(const SentWeight& sent, std::span<const SE3> poses) const {
  const bool is_own = sent.child == own_.graph().self;
  const Child* child = is_own ? nullptr : &children_.at(sent.child);
  SentEdge edge = is_own ? own_.sent_edge(sent.edge, poses) : child->system.edges[sent.edge];
  const EdgeSlot slot = is_own ? own_.slots()[sent.edge] : child->slot_of(edge);
  const int i = plan_->place_of_kept()[at(slot.i)], j = plan_->place_of_kept()[at(slot.j)];
  edge.pair = index_of(plan_->kept_pairs(), i, j);
  edge.transposed = i > j;
  edge.weight = weight_of(sent);
  return edge;
}

float TreeFront::weight_of(const SentWeight& sent) const {
  return sent.child == own_.graph().self ? static_cast<float>(own_.weight(sent.edge))
                                         : children_.at(sent.child).system.edges[sent.edge].weight;
}

std::vector<NewWeight> TreeFront::changed_weights() {
  std::vector<NewWeight> changes;
  for (std::size_t k = 0; k < sent_.size(); ++k) {
    const float weight = weight_of(sent_[k]);
    if (!own_.misleads(weight, sent_[k].sent)) continue;
    sent_[k].sent = weight;
    changes.push_back({static_cast<std::uint32_t>(k), weight});
  }
  return changes;
}

// The decrement is summed over the eliminated rows, not computed as the whole norm minus that of
// the kept rows. Kept rows can be large while only their sum over the team is small. The rounding
// error of the difference would then appear as a predicted decrease.
TreeFront::Reduced TreeFront::reduce(std::span<const SE3> poses,
                                     const std::map<RobotId, VectorXd>& children) {
  const Index B = own_.block();
  forwarded_ = own_.slopes(poses);
  for (const auto& [name, of_child] : children) {
    const Child& child = children_.at(name);
    if (of_child.size() != B * std::ssize(child.node))
      refuse(name, "sends a right-hand side of another size than its system");
    for (Index k = 0; k < std::ssize(child.node); ++k)
      forwarded_.middleRows(B * child.node[at(k)], B) += of_child.segment(B * k, B);
  }
  factor_->forward(forwarded_);
  Reduced reduced{rows_of(forwarded_.col(0), B, plan_->kept())};
  for (int node = 0; node < plan_->nodes(); ++node)
    if (plan_->place_of_kept()[at(node)] < 0)
      reduced.decrement += forwarded_.middleRows(B * node, B).squaredNorm();
  return reduced;
}

TreeFront::Reduced TreeFront::solve_root(bool upright) const {
  const VectorXd reduced = rows_of(forwarded_.col(0), own_.block(), plan_->kept());
  Reduced step{VectorXd::Zero(reduced.size())};
  const auto tilts = tilts_of(factor_->schur(), upright);
  if (!tilts) return step;
  const Eigen::Vector2d along = tilts->directions.transpose() * reduced.head<3>();
  const Eigen::Vector2d turn = along.cwiseQuotient(tilts->stiffness);
  step.decrement = along.dot(turn);
  step.kept.head<3>() = tilts->directions * turn;
  return step;
}

MatrixXd TreeFront::substitute_back(const VectorXd& kept) const {
  const Index B = own_.block();
  if (kept.size() != B * std::ssize(plan_->kept()))
    refuse(own_.graph().self, "receives a step of another size");
  MatrixXd X = forwarded_;
  for (Index k = 0; k < std::ssize(plan_->kept()); ++k)
    X.middleRows(B * plan_->kept()[at(k)], B) = kept.segment(B * k, B);
  factor_->backward(X);
  return X.reshaped(B, plan_->nodes());
}

VectorXd TreeFront::step_of_child(RobotId name, const MatrixXd& steps) const {
  return rows_of(steps.reshaped(), own_.block(), children_.at(name).node);
}

std::optional<BlockMatrix> TreeFront::inverse(const TreeInverse& from_parent) const {
  const auto kept = from_parent.decoded(plan_->kept_pairs(), factor_->schur());
  return kept ? std::optional(factor_->selected_inverse(*kept)) : std::nullopt;
}

// The factorisation for Newton steps holds a pose in the middle of the graph: rounds that reuse
// earlier second derivatives then converge faster. Covariances need a factorisation with the origin
// held.
std::optional<BlockMatrix> TreeFront::inverse_about_origin(bool upright) {
  const FrontGraph& graph = own_.graph();
  if (!graph.free) return factor_->selected_inverse(BlockMatrix::zero(own_.block(), 0, 0));
  std::vector<bool> keep(own_.nodes().size(), false);
  const auto origin = graph.origin ? own_.find(*graph.origin) : std::nullopt;
  keep[origin.value_or(at(graph.poses / 2))] = true;
  factor_.reset();
  FrontalCholesky factor(std::make_shared<const EliminationPlan>(std::move(keep), plan_->pairs()));
  if (!factor.factorise(assembled())) return std::nullopt;
  return inverse_about_kept(factor, upright);
}

BlockMatrix TreeFront::inverse_about_held(bool upright) const {
  return inverse_about_kept(*factor_, upright);
}

TreeInverse TreeFront::inverse_of_child(RobotId name, const BlockMatrix& inverse, bool fine) const {
  const Child& child = children_.at(name);
  BlockMatrix part = BlockMatrix::zero(own_.block(), child.node.size(), child.pairs.size());
  for (std::size_t k = 0; k < child.node.size(); ++k)
    part.at(static_cast<int>(k)) = inverse.at(child.node[k]);
  for (std::size_t p = 0; p < child.pairs.size(); ++p)
    part.add(static_cast<int>(p), child.pairs[p].i > child.pairs[p].j,
             inverse.between(child.pairs[p].pair));
  return TreeInverse::of(part, child.system.pairs, child.system.schur, fine);
}

}  // namespace km
