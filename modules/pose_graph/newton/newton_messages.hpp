#pragma once

#include <cstdint>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/pose_graph/newton/block_matrix.hpp"
#include "modules/pose_graph/newton/kept_edge.hpp"
#include "modules/pose_graph/newton/link_cover.hpp"

namespace km {

/// First message of a robot that solves with others by NewtonAgent: what is public of it.
struct NewtonHello {
  RobotId robot = 0;
  std::vector<PublicLink> links = {};     ///< To robots with higher ids, ascending.
  std::vector<KeyframeIndex> poses = {};  ///< Public poses, ascending.
  std::vector<SE3> T_world_pose = {};     ///< Of those; empty if the team starts without any.
};

/// Round of a robot: its part of the system, eliminated onto the team's separators.
struct NewtonShare {
  RobotId robot = 0;
  std::uint32_t round = 0;
  double cost = 0.0;       ///< Of its edges, at the poses the system belongs to.
  double decrement = 0.0;  ///< Squared norm of the forward-substituted eliminated right-hand side.
  Eigen::Index block = 0;  ///< Unknowns per pose, B.
  Eigen::MatrixXd reduced = {};  ///< (B kept) x k: right-hand side of the kept nodes.
  /// Of the kept nodes, without the edges between them; empty: as in the round before.
  BlockMatrix schur = {};
  Curvature curvature = Curvature::kGaussNewton;  ///< Of the second derivatives in it.
  std::vector<KeptEdge> edges = {};  ///< Those between kept nodes, where schur is not empty.
  // Pattern of the Schur complement, with the first one only.
  std::vector<KeyframeId> kept = {};  ///< Separators of the team.
  std::vector<NodePair> pairs = {};   ///< Coupled ones, in places of `kept`.
};

}  // namespace km
