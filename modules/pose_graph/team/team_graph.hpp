#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/pose_graph/local_graph.hpp"
#include "modules/pose_graph/quadratic_problem.hpp"

namespace km {

/// A pose graph dealt out to robots 0 to N - 1. Poses are numbered robot by robot, so that robot k
/// owns the contiguous block [first[k], first[k + 1]); within a block they are in the order in
/// which the robot drove. Solutions of the team are r x 4n in this numbering.
struct TeamGraph {
  int dimension = 3;                     ///< 2: planar, lifted to z = 0; cost and weights are 2D's.
  std::vector<Eigen::Index> first = {};  ///< N + 1 entries, ascending, from 0.
  std::vector<BlockEdge> edges = {};     ///< Each once; parallel ones all count.
  std::vector<KeyframeId> ids = {};      ///< Of the poses, as in the file.
  /// Of poses that know which way is up, ascending. If there are any, solutions have z up.
  /// GaussSeidelTeam, AsynchronousTeam, GncTeam and verify_team() do without.
  std::vector<VerticalPrior> verticals = {};

  [[nodiscard]] std::size_t robots() const { return first.size() - 1; }
  [[nodiscard]] Eigen::Index poses() const { return first.back(); }
  [[nodiscard]] Eigen::Index poses_of(std::size_t robot) const {
    return first[robot + 1] - first[robot];
  }
  [[nodiscard]] std::size_t robot_of(Eigen::Index pose) const;
};

/// What one robot of the team knows: its own edges, numbered from 0 in its block, and those to
/// others, numbered likewise at the other end.
struct RobotPart {
  Eigen::Index poses = 0;
  std::vector<BlockEdge> own_edges = {};
  std::map<RobotId, std::vector<InterEdge>> edges_to = {};  ///< No empty entries.
  std::vector<VerticalPrior> verticals = {};                ///< Numbered as the own edges.
};

[[nodiscard]] RobotPart part_of(const TeamGraph& graph, std::size_t robot);

/// The cost of the whole graph at rank r. Throws std::invalid_argument as QuadraticProblem does.
[[nodiscard]] QuadraticProblem problem_of(const TeamGraph& graph, Eigen::Index rank);

/// Local numbers of the poses of `robot` that edges to others end on, ascending.
[[nodiscard]] std::vector<Eigen::Index> separators_of(const TeamGraph& graph, std::size_t robot);

}  // namespace km
