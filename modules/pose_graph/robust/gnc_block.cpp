#include "modules/pose_graph/robust/gnc_block.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>

#include "modules/pose_graph/robust/gnc_edges.hpp"

namespace km {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Second derivatives mislead a step from here on: an edge is held half as strongly as it should be,
// or twice. Weights below the second number say nothing beside odometry.
constexpr double kWeightRatio = 2.0;
constexpr double kNoWeight = 0.02;

RobotGraph graph_of(const RobotEdges& edges) {
  std::set<KeyframeId> cover;
  for (const auto& [peer, list] : edges.to)
    for (const InterEdge& e : list) cover.insert({edges.self, e.own});
  const std::vector<KeyframeId> ascending(cover.begin(), cover.end());
  return {RobotEdges{edges.self, edges.poses, edges.own, {}}, ascending,
          RobotGraph::Keep::kCoverOnly};
}

}  // namespace

GncBlock::GncBlock(const RobotEdges& edges, int dimension)
    : self_(edges.self),
      dimension_(dimension),
      graph_(graph_of(edges)),
      factor_(graph_.plan()),
      edges_(edges.own),
      weights_(edges.own.size(), 1.0) {
  for (const KeyframeId& id : graph_.kept()) public_.push_back(id.index);
}

void GncBlock::weigh(std::span<const double> weights) {
  weights_.assign(weights.begin(), weights.end());
  std::vector<BlockEdge> weighted = edges_;
  for (std::size_t k = 0; k < weighted.size(); ++k) {
    weighted[k].kappa *= weights[k];
    weighted[k].tau *= weights[k];
  }
  graph_.set_precisions(weighted);
}

bool GncBlock::stale() const {
  if (factor_weights_.empty()) return true;
  for (std::size_t k = 0; k < weights_.size(); ++k) {
    const auto [less, more] = std::minmax(weights_[k], factor_weights_[k]);
    if (more > kNoWeight && more > kWeightRatio * less) return true;
  }
  return false;
}

double GncBlock::residual(std::size_t edge, std::span<const SE3> poses) const {
  const BlockEdge& e = edges_[edge];
  return edge_residual(poses[static_cast<std::size_t>(e.i)], poses[static_cast<std::size_t>(e.j)],
                       e.T_i_j, e.kappa, e.tau);
}

double GncBlock::cost(std::span<const SE3> poses) const {
  double cost = 0.0;
  for (std::size_t k = 0; k < edges_.size(); ++k) {
    const double r = residual(k, poses);
    cost += weights_[k] * r * r;
  }
  return cost;
}

void GncBlock::factorise(std::span<const SE3> poses, Curvature curvature) {
  factor_weights_ = weights_;
  if (curvature == Curvature::kFull &&
      factor_.factorise(newton_system(graph_, poses, dimension_, curvature).A))
    return;
  if (!factor_.factorise(newton_system(graph_, poses, dimension_, Curvature::kGaussNewton).A))
    throw std::runtime_error("GncBlock: poses of robot " + std::to_string(self_) +
                             " hang together with no public one");
}

GncShare GncBlock::share(std::span<const SE3> poses, std::optional<Curvature> curvature) {
  GncShare share{.robot = self_};
  if (curvature) {
    factorise(poses, *curvature);
    share.schur = factor_.schur();
  }
  RobotSystem slope = newton_slope(graph_, poses, dimension_);
  share.cost = slope.cost;
  forwarded_ = std::move(slope.C);
  factor_.forward(forwarded_);
  share.decrement = forwarded_.squaredNorm();
  const Index block = share.block = tangent_size(dimension_);
  const std::vector<int>& kept = graph_.plan()->kept();
  share.reduced.resize(block * static_cast<Index>(kept.size()));
  for (std::size_t k = 0; k < kept.size(); ++k)
    share.reduced.segment(block * static_cast<Index>(k), block) =
        forwarded_.middleRows(block * kept[k], block);
  share.decrement -= share.reduced.squaredNorm();
  return share;
}

MatrixXd GncBlock::substitute_back(const Eigen::Ref<const MatrixXd>& steps) const {
  MatrixXd X = forwarded_;
  const Index block = tangent_size(dimension_);
  const std::vector<int>& kept = graph_.plan()->kept();
  for (std::size_t k = 0; k < kept.size(); ++k)
    X.middleRows(block * kept[k], block) = steps.col(static_cast<Index>(k));
  factor_.backward(X);
  return X.reshaped(block, graph_.nodes());
}

}  // namespace km
