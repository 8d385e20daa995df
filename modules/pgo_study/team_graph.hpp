#pragma once

#include <cstddef>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/pose_graph/quadratic_problem.hpp"
#include "modules/pose_graph/session_graph.hpp"

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
  /// GaussSeidelTeam, AsynchronousTeam and verify_team() do without.
  std::vector<VerticalPrior> verticals = {};
  std::size_t indefinite_edges = 0;  ///< Of the files, see G2oGraph.

  [[nodiscard]] std::size_t robots() const { return first.size() - 1; }
  [[nodiscard]] Eigen::Index poses() const { return first.back(); }
  [[nodiscard]] Eigen::Index poses_of(std::size_t robot) const {
    return first[robot + 1] - first[robot];
  }
  [[nodiscard]] std::size_t robot_of(Eigen::Index pose) const;
};

/// Which edges are odometry: the first one from a pose to the next of the same robot of the file.
[[nodiscard]] std::vector<bool> odometry_edges(const TeamGraph& graph);

/// The graph with those of its edges that are `kept`.
[[nodiscard]] TeamGraph with_edges(TeamGraph graph, const std::vector<bool>& kept);

/// The graph without the odometry that a cut has left between two robots: closures alone join
/// robots, as in the field. The graph need not be connected any more.
[[nodiscard]] TeamGraph without_cut_steps(TeamGraph graph);

/// The connected part that each pose is in, by the lowest pose of that part.
[[nodiscard]] std::vector<Eigen::Index> part_of_poses(const TeamGraph& graph);

/// What one robot of the team knows of the graph, without any poses: `start` and `told` are empty.
/// Robot k has id k, and its keyframes are its poses, from 0. Odometry that was cut between two
/// robots is trusted. `step_precision` is that of all robots.
[[nodiscard]] SessionGraph part_of(const TeamGraph& graph, std::size_t robot);

/// The cost of the whole graph at rank r. Throws std::invalid_argument as QuadraticProblem does.
[[nodiscard]] QuadraticProblem problem_of(const TeamGraph& graph, Eigen::Index rank);

}  // namespace km
