#pragma once

#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "modules/core/geometry/lie.hpp"
#include "modules/core/geometry/precision.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/split_graph.hpp"

namespace km {

/// Robots that walk around each other in a box, with closures between those in `pairs`.
inline SplitGraph random_team(unsigned seed, const std::vector<RobotId>& ids,
                              std::uint32_t keyframes,
                              const std::vector<std::pair<RobotId, RobotId>>& pairs) {
  std::mt19937 rng(seed);
  const Matrix6 covariance = covariance_of({.kappa = 2500.0, .tau = 100.0});
  const auto measure = [&](const SE3& T_a, const SE3& T_b) {
    const SE3 exact = T_a.inverse() * T_b;
    const Eigen::Vector3d phi = 0.02 * random_vector<3>(rng);
    const Eigen::Vector3d t = 0.1 * random_vector<3>(rng);
    const Eigen::AngleAxisd R(phi.norm(), phi.normalized());
    return exact * make_pose(R.toRotationMatrix(), t);
  };
  SplitGraph graph;
  std::map<RobotId, std::vector<SE3>> truth;
  for (const RobotId id : ids) {
    graph.keyframes[id] = keyframes;
    SE3 T = random_pose(rng, 5.0);
    for (std::uint32_t i = 0; i < keyframes; ++i) {
      truth[id].push_back(T);
      const Eigen::Vector3d phi = 0.3 * random_vector<3>(rng);
      const Eigen::AngleAxisd R(phi.norm(), phi.normalized());
      T = T * make_pose(R.toRotationMatrix(), {1.0, 0.0, 0.0});
    }
    for (std::uint32_t i = 0; i + 1 < keyframes; ++i)
      graph.odometry.push_back(
          {{id, i}, {id, i + 1}, measure(truth[id][i], truth[id][i + 1]), covariance});
  }
  std::uniform_int_distribution<std::uint32_t> any(1, keyframes - 1);
  std::set<ClosureId> drawn;
  for (const auto& [a, b] : pairs)
    for (int k = 0; k < 8; ++k) {
      const std::uint32_t i = any(rng);
      const KeyframeId from{k % 2 == 0 ? a : b, i};
      const KeyframeId to{k % 2 == 0 ? b : a, any(rng)};
      if (!drawn.insert({from, to}).second) continue;
      const SE3 T = measure(truth[from.robot][from.index], truth[to.robot][to.index]);
      graph.closures.push_back({from, to, T, covariance});
    }
  return graph;
}

}  // namespace km
