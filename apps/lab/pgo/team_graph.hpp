#pragma once

#include <cstddef>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/rbcd/quadratic_problem.hpp"
#include "modules/robust/session_graph.hpp"

namespace km {

/// A pose graph divided among robots 0 to N - 1. Poses are numbered robot by robot, so that robot k
/// owns the contiguous block [first[k], first[k + 1]). Within a block they are in the order of the
/// robot's trajectory. Solutions of the team are r x 4n in this numbering.
struct TeamGraph {
  int dimension = 3;                     ///< 2: planar, lifted to z = 0, with the cost and weights
                                         ///< of 2D.
  std::vector<Eigen::Index> first = {};  ///< N + 1 entries, ascending, from 0.
  std::vector<BlockEdge> edges = {};     ///< Each edge once. Parallel edges all count.
  std::vector<KeyframeId> ids = {};      ///< Ids of the poses in the file.
  /// Poses in the file, which start the solution where odometry has gaps; empty without vertices.
  std::vector<SE3> vertices = {};
  /// Vertical priors, ascending by pose. If there are any, solutions have z up.
  std::vector<VerticalPrior> verticals = {};
  std::size_t indefinite_edges = 0;  ///< Number in the files, see G2oGraph.

  [[nodiscard]] std::size_t robots() const { return first.size() - 1; }
  [[nodiscard]] Eigen::Index poses() const { return first.back(); }
  [[nodiscard]] Eigen::Index poses_of(std::size_t robot) const {
    return first[robot + 1] - first[robot];
  }
  [[nodiscard]] std::size_t robot_of(Eigen::Index pose) const;
  /// Id of a pose in the team: robot k has id k, and its keyframes are its poses from 0.
  [[nodiscard]] KeyframeId keyframe_of(Eigen::Index pose) const;
};

/// By edge: whether it is odometry, that is the first edge from a pose to the next of the same
/// robot of the file.
[[nodiscard]] std::vector<bool> odometry_edges(const TeamGraph& graph);

/// The odometry of `robot` from each of its keyframes to the next; steps that are no edge of the
/// graph are unknown_step(). Ids are those of TeamGraph::keyframe_of().
[[nodiscard]] std::vector<PoseEdge> odometry_steps(const TeamGraph& graph, std::size_t robot);

/// The graph with only those edges that are `kept`.
[[nodiscard]] TeamGraph with_edges(TeamGraph graph, const std::vector<bool>& kept);

/// The graph without steps of odometry between two robots, which remain where one trajectory was
/// cut. Afterwards only closures join robots, as in the field, and the graph may be disconnected.
[[nodiscard]] TeamGraph without_cut_steps(TeamGraph graph);

/// By pose: the lowest pose of its connected part.
[[nodiscard]] std::vector<Eigen::Index> part_of_poses(const TeamGraph& graph);

/// The edges and priors that one robot of the team knows, without any poses: `start` and
/// `public_poses` are empty. Ids are those of TeamGraph::keyframe_of(). `step_precision` has the
/// values of all robots.
[[nodiscard]] SessionGraph part_of(const TeamGraph& graph, std::size_t robot);

/// The whole graph as that of one robot, with id 0, that starts at `start`.
[[nodiscard]] SessionGraph whole_session(const TeamGraph& graph, std::vector<SE3> start);

/// Cost function of the whole graph at rank r. Throws std::invalid_argument as QuadraticProblem
/// does.
[[nodiscard]] QuadraticProblem problem_of(const TeamGraph& graph, Eigen::Index rank);

/// A connected part of a team's graph. Robots, poses and edges keep the order of the whole graph.
struct ConnectedPart {
  TeamGraph graph;                 ///< Graph of the robots that have a pose in the part.
  std::vector<std::size_t> poses;  ///< [i]: number of pose i in the whole graph.
  std::vector<std::size_t> edges;  ///< [k]: number of edge k in the whole graph.
};

/// Returns the connected parts of the subgraph of the kept edges, ascending by their first pose.
/// Precondition: `keep_edge` has an element for each edge.
[[nodiscard]] std::vector<ConnectedPart> connected_parts(const TeamGraph& graph,
                                                         const std::vector<bool>& keep_edge);

}  // namespace km
