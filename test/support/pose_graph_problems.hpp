#pragma once

#include <filesystem>
#include <random>
#include <vector>

#include "modules/core/geometry/lie.hpp"
#include "modules/core/geometry/precision.hpp"
#include "modules/rbcd/truncated_newton.hpp"
#include "modules/recorded_graph/g2o_io.hpp"
#include "modules/tree_newton/chordal.hpp"
#include "test/support/random_pose.hpp"

namespace km {

/// A pose graph as one block: the whole of it belongs to one robot.
struct WholeGraph {
  Eigen::Index poses = 0;
  std::vector<BlockEdge> edges;
};

inline BlockEdge block_edge(Eigen::Index i, Eigen::Index j, const RelativePose& measured) {
  const Precision weight = precision_of(measured.covariance);
  return {i, j, measured.T_from_to, weight.kappa, weight.tau};
}

/// A g2o file of one robot, whose keyframes are 0, 1, 2, ...
inline WholeGraph read_whole_graph(const std::filesystem::path& file) {
  const G2oGraph graph = read_g2o(file);
  WholeGraph whole;
  for (const RelativePose& e : graph.edges) {
    whole.edges.push_back(block_edge(e.from.index, e.to.index, e));
    whole.poses =
        std::max({whole.poses, Eigen::Index{e.from.index} + 1, Eigen::Index{e.to.index} + 1});
  }
  return whole;
}

/// Feasible poses with uniform rotations and rank r: the product of random ones with a random
/// matrix of St(3, r).
inline LiftedPoses random_lifted_poses(std::mt19937& rng, Eigen::Index rank, Eigen::Index poses) {
  std::normal_distribution<double> normal;
  LiftedPoses X(rank, 4 * poses);
  for (double& x : X.reshaped()) x = normal(rng);
  for (Eigen::Index i = 0; i < poses; ++i)
    X.middleCols<3>(4 * i) = nearest_stiefel(X.middleCols<3>(4 * i));
  return X;
}

}  // namespace km
