#include "modules/tree_newton/front_edges.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace km {
namespace {

using Eigen::Index;

// Ratio of weights from which on old second derivatives mislead a step: the stiffness of an edge is
// half or twice its correct value. Weights below kNoWeight are negligible compared to odometry.
constexpr double kWeightRatio = 2.0;
constexpr double kDecidedRatio = 1.01;  // for covariances too
constexpr double kNoWeight = 0.02;
// An edge with a weight below this is rejected. It has no cost and no gradient; its stiffness only
// keeps the system regular.
constexpr double kRejected = 1e-6;

Precision weighed(const Precision& precision, double weight) {
  return {weight * precision.kappa, weight * precision.tau};
}

// Why the edge cannot be used; empty if it can.
std::string fault_of(const PoseEdge& e, const EdgeSlot& slot) {
  const auto& [kappa, tau] = e.precision;
  if (!e.T_from_to.matrix().allFinite() || !(kappa > 0.0) || !(tau > 0.0) ||
      !std::isfinite(kappa + tau))
    return "an edge is not finite with positive precisions";
  if (e.from == e.to) return "an edge joins pose " + to_string(e.from) + " with itself";
  return slot.i < 0 && slot.j < 0 ? "an edge joins two held poses" : "";
}

}  // namespace

FrontEdges::FrontEdges(FrontGraph graph)
    : graph_(std::move(graph)), weights_(graph_.edges.size(), 1.0) {
  const auto refuse = [&](const std::string& what) {
    throw std::invalid_argument("FrontEdges of robot " + std::to_string(graph_.self) + ": " + what);
  };
  if (graph_.poses < 1) refuse("it has no poses");
  for (Index k = 0; k < graph_.poses; ++k)
    nodes_.push_back({graph_.self, static_cast<KeyframeIndex>(k)});
  const auto node = [&](const KeyframeId& id) {
    return graph_.held.contains(id) ? -1 : add_node(id);
  };
  for (const PoseEdge& e : graph_.edges) {
    slots_.push_back({.i = node(e.from), .j = node(e.to)});
    if (const std::string fault = fault_of(e, slots_.back()); !fault.empty()) refuse(fault);
  }
  for (const VerticalPrior& v : graph_.verticals)
    if (v.pose < 0 || v.pose >= graph_.poses || !v.up.allFinite() || !(v.weight > 0.0))
      refuse("a vertical prior is not usable");
}

int FrontEdges::add_node(const KeyframeId& id) {
  if (id.robot == graph_.self) {
    if (id.index >= graph_.poses)
      throw std::invalid_argument("FrontEdges: pose " + to_string(id) + " of " +
                                  std::to_string(graph_.poses));
    return static_cast<int>(id.index);
  }
  const auto [entry, added] = foreign_.try_emplace(id, static_cast<int>(nodes_.size()));
  if (added) nodes_.push_back(id);
  return entry->second;
}

std::optional<std::size_t> FrontEdges::find(const KeyframeId& id) const {
  if (id.robot == graph_.self && id.index < graph_.poses) return id.index;
  const auto foreign = foreign_.find(id);
  return foreign == foreign_.end() ? std::nullopt : std::optional(at(foreign->second));
}

const SE3& FrontEdges::pose_of(int node, const KeyframeId& id, std::span<const SE3> poses) const {
  return node < 0 ? graph_.held.at(id) : poses[at(node)];
}

void FrontEdges::weigh(std::vector<double> weights, bool decided) {
  weights_ = std::move(weights);
  weights_.resize(graph_.edges.size(), 1.0);
  decided_ = decided;
}

bool FrontEdges::misleads(double weight, double before) const {
  const auto [less, more] = std::minmax(weight, before);
  return more > kNoWeight && more > (decided_ ? kDecidedRatio : kWeightRatio) * less;
}

bool FrontEdges::stale() const {
  if (linearised_weights_.empty()) return true;
  for (std::size_t k = 0; k < weights_.size(); ++k)
    if (!slots_[k].sent && misleads(weights_[k], linearised_weights_[k])) return true;
  return false;
}

double FrontEdges::cost(std::span<const SE3> poses) const {
  double cost = 0.0;
  for (std::size_t k = 0; k < slots_.size(); ++k) {
    if (weights_[k] < kRejected) continue;
    const auto& [i, j, pair, sent] = slots_[k];
    const PoseEdge& e = graph_.edges[k];
    const double r = residual_of(e, pose_of(i, e.from, poses), pose_of(j, e.to, poses));
    cost += weights_[k] * r * r;
  }
  if (block() == 6)
    for (const VerticalPrior& v : graph_.verticals)
      cost += model_vertical(v, poses[at(v.pose)].linear(), Curvature::kGaussNewton).cost;
  return cost;
}

Eigen::MatrixXd FrontEdges::slopes(std::span<const SE3> poses) const {
  const Index B = block();
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(B * static_cast<Index>(nodes_.size()), 1);
  EdgeModel model;
  const auto subtract = [&](int node, const Vector6& g) {
    if (node >= 0) rows.middleRows(B * node, B) -= g.segment(first_row_of(B), B);
  };
  for (std::size_t k = 0; k < slots_.size(); ++k) {
    if (weights_[k] < kRejected) continue;
    const auto& [i, j, pair, sent] = slots_[k];
    const PoseEdge& e = graph_.edges[k];
    set_cost_and_gradient(e.T_from_to, weighed(e.precision, weights_[k]), pose_of(i, e.from, poses),
                          pose_of(j, e.to, poses), model);
    subtract(i, model.g_i);
    subtract(j, model.g_j);
  }
  if (B == 6)
    for (const VerticalPrior& v : graph_.verticals)
      rows.middleRows<3>(6 * v.pose) -=
          model_vertical(v, poses[at(v.pose)].linear(), Curvature::kGaussNewton).g;
  return rows;
}

template <int kBlock>
void FrontEdges::add_edges(std::span<const SE3> poses) {
  constexpr Index kFirst = first_row_of(kBlock);
  const auto part = [](const Matrix6& H) { return H.block<kBlock, kBlock>(kFirst, kFirst); };
  for (std::size_t k = 0; k < slots_.size(); ++k) {
    const auto& [i, j, pair, sent] = slots_[k];
    if (sent || weights_[k] == 0.0) continue;
    const PoseEdge& e = graph_.edges[k];
    const EdgeModel model =
        model_edge(e.T_from_to, weighed(e.precision, weights_[k]), pose_of(i, e.from, poses),
                   pose_of(j, e.to, poses), curvature_);
    if (i >= 0) H_.diagonal.middleCols<kBlock>(kBlock * i) += part(model.H_ii);
    if (j >= 0) H_.diagonal.middleCols<kBlock>(kBlock * j) += part(model.H_jj);
    if (pair >= 0) H_.add(pair, i > j, part(model.H_ij));
  }
  if constexpr (kBlock == 6)
    for (const VerticalPrior& v : graph_.verticals)
      H_.diagonal.block<3, 3>(0, 6 * v.pose) +=
          model_vertical(v, poses[at(v.pose)].linear(), curvature_).H;
}

void FrontEdges::linearise(std::span<const SE3> poses, Curvature curvature, std::size_t pairs) {
  curvature_ = curvature;
  H_ = BlockMatrix::zero(block(), nodes_.size(), pairs);
  if (block() == 3)
    add_edges<3>(poses);
  else
    add_edges<6>(poses);
  linearised_weights_ = weights_;
}

SentEdge FrontEdges::sent_edge(std::size_t edge, std::span<const SE3> poses) const {
  const PoseEdge& e = graph_.edges[edge];
  const auto& [i, j, pair, sent] = slots_[edge];
  return {.curvature = curvature_,
          .kappa = static_cast<float>(e.precision.kappa),
          .tau = static_cast<float>(e.precision.tau),
          .present = SinglePose::of(poses[at(i)].inverse() * poses[at(j)]),
          .measured = SinglePose::of(e.T_from_to)};
}

}  // namespace km
