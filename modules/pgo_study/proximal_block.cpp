#include "modules/pgo_study/proximal_block.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace km {
namespace {

// The problem of a block with every inter-robot edge `1 + weight` times as precise, and a fixed
// pose of its own for each.
QuadraticProblem weighted(const QuadraticProblem& problem, double weight) {
  std::vector<PublicEdge> public_edges = problem.public_edges();
  for (std::size_t k = 0; k < public_edges.size(); ++k) {
    public_edges[k].fixed = static_cast<Eigen::Index>(k);
    public_edges[k].kappa *= 1.0 + weight;
    public_edges[k].tau *= 1.0 + weight;
  }
  return {problem.rank(), problem.poses(), problem.edges(), std::move(public_edges)};
}

double checked_weight(double weight) {
  if (!(weight >= 0.0) || !std::isfinite(weight))
    throw std::invalid_argument("ProximalBlock: weight " + std::to_string(weight) +
                                " is not a finite number from 0");
  return weight;
}

}  // namespace

ProximalBlock::ProximalBlock(const SessionGraph& part, LiftedPoses X, double weight)
    : block_(part, std::move(X)),
      weight_(checked_weight(weight)),
      problem_(weighted(block_.problem(), weight)) {}

TruncatedNewtonResult ProximalBlock::update(const TruncatedNewtonOptions& options,
                                            double relaxation) {
  const QuadraticProblem& heard = block_.problem();
  const LiftedPoses& X = block_.X();
  const auto& edges = heard.public_edges();
  LiftedPoses targets(X.rows(), 4 * static_cast<Eigen::Index>(edges.size()));
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const PublicEdge& e = edges[k];
    const auto neighbour = heard.fixed().middleCols<4>(4 * e.fixed);
    const SE3 T_own_fixed = e.from_own ? e.T : e.T.inverse();
    targets.middleCols<4>(4 * static_cast<Eigen::Index>(k)) =
        (neighbour + weight_ * lift(X.middleCols<4>(4 * e.own), T_own_fixed)) / (1.0 + weight_);
  }
  problem_.set_fixed(std::move(targets));
  TruncatedNewtonResult result = minimise_beyond(problem_, X, options, relaxation);
  block_.move_to(result.X);
  return result;
}

}  // namespace km
