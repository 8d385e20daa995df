#pragma once

#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "apps/lab/pgo/team_graph_file.hpp"
#include "modules/core/geometry/lie.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/shared_data.hpp"

namespace km {

/// A recorded graph divided among `robots`, or with 0 the folder of a team; nullopt if it is
/// missing.
inline std::optional<TeamGraph> recorded_team(const std::string& name, std::size_t robots) {
  const auto path = shared_data(name);
  if (!path) return std::nullopt;
  return robots == 0 ? read_team_folder(*path)
                     : partition_contiguously(read_g2o(*path), robots, name);
}

/// A chain of `poses` with edges also to the fifth pose after each and to a far one. It is exact
/// except for noise of `sigma` in each component. Every third pose has a vertical with the same
/// noise if `vertical_weight` is positive.
inline TeamGraph noisy_chain(Eigen::Index poses, std::size_t robots, double sigma,
                             std::mt19937& rng, double vertical_weight = 0.0) {
  std::normal_distribution<double> normal(0.0, sigma);
  std::vector<SE3> truth(1, SE3::Identity());
  for (Eigen::Index i = 1; i < poses; ++i) truth.push_back(truth.back() * random_pose(rng));
  TeamGraph graph;
  for (std::size_t k = 0; k <= robots; ++k)
    graph.first.push_back(poses * static_cast<Eigen::Index>(k) / static_cast<Eigen::Index>(robots));
  for (Eigen::Index i = 0; i < poses; ++i) {
    graph.ids.push_back({0, static_cast<std::uint32_t>(i)});
    for (const Eigen::Index j : {i + 1, i + 5, (7 * i + 3) % poses}) {
      if (j >= poses || j == i) continue;
      Vector6 noise;
      for (double& n : noise) n = normal(rng);
      const SE3 T =
          truth[static_cast<std::size_t>(i)].inverse() * truth[static_cast<std::size_t>(j)];
      graph.edges.push_back({i, j, T * se3_exp(noise), 2.0, 3.0});
    }
  }
  for (Eigen::Index i = 0; vertical_weight > 0.0 && i < poses; i += 3) {
    const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d up = truth[static_cast<std::size_t>(i)].linear().transpose() * z;
    const Eigen::Vector3d noise(normal(rng), normal(rng), normal(rng));
    graph.verticals.push_back({i, (up + noise).normalized(), vertical_weight});
  }
  return graph;
}

/// A ring of equal rotations at one place, and the wrong solution that rotates once along the ring.
/// It is a critical point of cost n (4 - 4 cos(2 pi / n)), while the optimum is 0.
struct WoundRing {
  TeamGraph graph;
  std::vector<SE3> wound;

  WoundRing(Eigen::Index n, std::size_t robots) {
    for (std::size_t k = 0; k <= robots; ++k)
      graph.first.push_back(n * static_cast<Eigen::Index>(k) / static_cast<Eigen::Index>(robots));
    for (Eigen::Index i = 0; i < n; ++i) {
      graph.ids.push_back({0, static_cast<std::uint32_t>(i)});
      graph.edges.push_back({i, (i + 1) % n, SE3::Identity(), 1.0, 1.0});
      const double angle = 2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(n);
      const Eigen::AngleAxisd R(angle, Eigen::Vector3d::UnitZ());
      wound.push_back(make_pose(R.toRotationMatrix(), Eigen::Vector3d::Zero()));
    }
  }
};

}  // namespace km
