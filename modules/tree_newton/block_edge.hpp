#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/tree_newton/pose_edge.hpp"

namespace km {

/// A relative pose between poses i and j of one block: poses that are solved together, e.g. those
/// of one robot. Its precisions are kappa of the rotation [1/rad^2], tau of the translation
/// [1/m^2].
struct BlockEdge {
  Eigen::Index i = 0;
  Eigen::Index j = 0;
  SE3 T_i_j = SE3::Identity();
  double kappa = 1.0;
  double tau = 1.0;
};

/// The edges of a robot between its own poses, as edges of the block of these poses.
[[nodiscard]] inline std::vector<BlockEdge> block_edges(std::span<const PoseEdge> own) {
  std::vector<BlockEdge> edges;
  edges.reserve(own.size());
  for (const PoseEdge& e : own)
    edges.push_back({e.from.index, e.to.index, e.T_from_to, e.precision.kappa, e.precision.tau});
  return edges;
}

}  // namespace km
