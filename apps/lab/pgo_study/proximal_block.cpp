#include "apps/lab/pgo_study/proximal_block.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace km {
namespace {

// Every inter-robot edge with `1 + weight` times its precision and a fixed pose of its own.
std::vector<PublicEdge> weighted(std::vector<PublicEdge> edges, double weight) {
  for (std::size_t k = 0; k < edges.size(); ++k) {
    edges[k].fixed = static_cast<Eigen::Index>(k);
    edges[k].kappa *= 1.0 + weight;
    edges[k].tau *= 1.0 + weight;
  }
  return edges;
}

double checked_weight(double weight) {
  if (!(weight >= 0.0) || !std::isfinite(weight))
    throw std::invalid_argument("ProximalBlock: weight " + std::to_string(weight) +
                                " is not a finite number from 0");
  return weight;
}

}  // namespace

ProximalBlock::ProximalBlock(const SessionGraph& part, LiftedPoses X, double weight)
    : X_(std::move(X)),
      border_(border_of(part)),
      weight_(checked_weight(weight)),
      problem_(X_.rows(), pose_count(X_), block_edges(part.own), weighted(border_.edges, weight)),
      received_(
          LiftedPoses::Zero(X_.rows(), 4 * static_cast<Eigen::Index>(border_.fixed_of.size()))) {}

bool ProximalBlock::set_neighbour(RobotId robot, const SentPoses& sent) {
  LiftedPoses received = received_;
  const auto begin = border_.fixed_of.lower_bound({robot, 0});
  for (auto it = begin; it != border_.fixed_of.end() && it->first.robot == robot; ++it) {
    const auto& keyframes = sent.keyframes;
    const auto at = std::lower_bound(keyframes.begin(), keyframes.end(), it->first.index);
    if (at == keyframes.end() || *at != it->first.index) return false;
    received.middleCols<4>(4 * it->second) = sent.X.middleCols<4>(4 * (at - keyframes.begin()));
  }
  received_ = std::move(received);
  return true;
}

TruncatedNewtonResult ProximalBlock::update(const TruncatedNewtonOptions& options,
                                            double relaxation) {
  LiftedPoses targets(X_.rows(), 4 * static_cast<Eigen::Index>(border_.edges.size()));
  for (std::size_t k = 0; k < border_.edges.size(); ++k) {
    const PublicEdge& e = border_.edges[k];
    const auto neighbour = received_.middleCols<4>(4 * e.fixed);
    const SE3 T_own_fixed = e.from_own ? e.T : e.T.inverse();
    targets.middleCols<4>(4 * static_cast<Eigen::Index>(k)) =
        (neighbour + weight_ * lift(X_.middleCols<4>(4 * e.own), T_own_fixed)) / (1.0 + weight_);
  }
  problem_.set_fixed(std::move(targets));
  TruncatedNewtonResult result = minimise_over_relaxed(problem_, X_, options, relaxation);
  X_ = result.X;
  return result;
}

SentPoses ProximalBlock::round_public_poses() {
  const auto& keyframes = border_.own;
  LiftedPoses poses(X_.rows(), 4 * static_cast<Eigen::Index>(keyframes.size()));
  for (std::size_t k = 0; k < keyframes.size(); ++k)
    poses.middleCols<4>(4 * static_cast<Eigen::Index>(k)) =
        X_.middleCols<4>(4 * Eigen::Index{keyframes[k]});
  poses = restore_stiefel(poses.cast<float>().cast<double>());
  for (std::size_t k = 0; k < keyframes.size(); ++k)
    X_.middleCols<4>(4 * Eigen::Index{keyframes[k]}) =
        poses.middleCols<4>(4 * static_cast<Eigen::Index>(k));
  return {keyframes, std::move(poses)};
}

}  // namespace km
