#include "modules/tree_newton/pose_edge.hpp"

#include <algorithm>
#include <cmath>

#include <tuple>

#include "modules/core/data/measurement_limits.hpp"

namespace km {
namespace {

auto rank_of(const PoseEdge& e) {
  const double trace = 1.5 / e.precision.kappa + 3.0 / e.precision.tau;  // see precision_of()
  const Eigen::Vector3d& t = e.T_from_to.translation();
  return std::tuple(trace, e.precision.kappa, e.from.index, t.x(), t.y(), t.z(), e.from);
}

}  // namespace

bool is_unknown_step(const PoseEdge& step) {
  constexpr double kThird = kUnknownStep_m / 3.0;
  return step.precision.tau * kThird * kThird < 1.0;
}

PoseEdge unknown_step(const KeyframeId& from) {
  return {from,
          {from.robot, from.index + 1},
          SE3::Identity(),
          {0.5 / (kUnknownTurn_rad * kUnknownTurn_rad), 1.0 / (kUnknownStep_m * kUnknownStep_m)}};
}

std::optional<PoseEdge> pose_edge(const RelativePose& measured) {
  const double rotation = measured.covariance.topLeftCorner<3, 3>().trace();
  const double translation = measured.covariance.bottomRightCorner<3, 3>().trace();
  const Eigen::Vector3d& t = measured.T_from_to.translation();
  if (!measured.T_from_to.matrix().allFinite() || !kStep_m.contains(t.minCoeff()) ||
      !kStep_m.contains(t.maxCoeff()) || !kVariance.contains(rotation) ||
      !kVariance.contains(translation))
    return std::nullopt;
  return PoseEdge{measured.from, measured.to, measured.T_from_to,
                  precision_of(measured.covariance)};
}

bool is_better(const PoseEdge& a, const PoseEdge& b) {
  return rank_of(a) < rank_of(b);
}

double residual_of(const PoseEdge& edge, const SE3& T_world_from, const SE3& T_world_to) {
  const SE3 predicted = T_world_from * edge.T_from_to;
  return std::sqrt(edge.precision.kappa * (T_world_to.linear() - predicted.linear()).squaredNorm() +
                   edge.precision.tau *
                       (T_world_to.translation() - predicted.translation()).squaredNorm());
}

bool mostly_fit(std::span<const PoseEdge> closures, const std::vector<SE3>& poses, double barc) {
  constexpr double kMostMisfits = 0.03;
  const auto misfits = std::ranges::count_if(closures, [&](const PoseEdge& e) {
    return residual_of(e, poses[e.from.index], poses[e.to.index]) > barc;
  });
  return static_cast<double>(misfits) <= kMostMisfits * static_cast<double>(closures.size());
}

}  // namespace km
