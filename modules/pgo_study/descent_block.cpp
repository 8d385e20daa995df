#include "modules/pgo_study/descent_block.hpp"

namespace km {

DescentBlock::DescentBlock(const SessionGraph& part, LiftedPoses X)
    : X_(std::move(X)),
      border_(border_of(part)),
      problem_(X_.rows(), pose_count(X_), block_edges(part.own), border_.edges, part.verticals),
      fixed_(LiftedPoses::Zero(X_.rows(), 4 * static_cast<Eigen::Index>(border_.fixed_of.size()))) {
}

bool DescentBlock::set_neighbour(RobotId robot, const ToldBlock& told) {
  LiftedPoses fixed = fixed_;
  const auto begin = border_.fixed_of.lower_bound({robot, 0});
  for (auto it = begin; it != border_.fixed_of.end() && it->first.robot == robot; ++it) {
    const auto& keyframes = told.keyframes;
    const auto at = std::lower_bound(keyframes.begin(), keyframes.end(), it->first.index);
    if (at == keyframes.end() || *at != it->first.index) return false;
    fixed.middleCols<4>(4 * it->second) = told.X.middleCols<4>(4 * (at - keyframes.begin()));
  }
  fixed_ = std::move(fixed);
  fixed_changed_ = true;
  return true;
}

TruncatedNewtonResult DescentBlock::update(const TruncatedNewtonOptions& options,
                                           double relaxation) {
  TruncatedNewtonResult result = minimise_beyond(problem(), X_, options, relaxation);
  X_ = result.X;
  return result;
}

ToldBlock DescentBlock::round_public_poses() {
  return {border_.own, round_poses(X_, border_.own)};
}

const QuadraticProblem& DescentBlock::problem() {
  if (fixed_changed_) problem_.set_fixed(fixed_);
  fixed_changed_ = false;
  return problem_;
}

double DescentBlock::gradient_norm() {
  return project_tangent(X_, problem().euclidean_gradient(X_)).norm();
}

double DescentBlock::share_of_cost(const std::set<RobotId>& counted) const {
  double cost = problem_.cost(X_);
  for (std::size_t k = 0; k < border_.edges.size(); ++k)
    if (!counted.contains(border_.robot_of_edge[k])) cost -= problem_.public_edge_cost(k, X_);
  return cost;
}

LiftedPoses round_poses(LiftedPoses& X, const std::vector<KeyframeIndex>& keyframes) {
  LiftedPoses poses(X.rows(), 4 * static_cast<Eigen::Index>(keyframes.size()));
  for (std::size_t k = 0; k < keyframes.size(); ++k)
    poses.middleCols<4>(4 * static_cast<Eigen::Index>(k)) =
        X.middleCols<4>(4 * Eigen::Index{keyframes[k]});
  poses = restore_stiefel(poses.cast<float>().cast<double>());
  for (std::size_t k = 0; k < keyframes.size(); ++k)
    X.middleCols<4>(4 * Eigen::Index{keyframes[k]}) =
        poses.middleCols<4>(4 * static_cast<Eigen::Index>(k));
  return poses;
}

}  // namespace km
