// Solves a 3D pose graph by a team of robots. Each robot has only its part of the graph, and the
// robots exchange messages. Here all robots are in one process; in the field each is on a computer
// of its own, and the same messages cross a network.
//   solve_as_team GRAPH.g2o ROBOTS POSES.tum
#include <algorithm>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <iostream>
#include <memory>
#include <vector>

#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/tree_newton.hpp"
#include "modules/recorded_graph/g2o_io.hpp"
#include "tum_row.hpp"

using namespace km;

int main(int argc, char** argv) try {
  if (argc != 4) throw std::invalid_argument("usage: solve_as_team GRAPH.g2o ROBOTS POSES.tum");
  const G2oGraph graph = read_g2o(std::filesystem::path(argv[1]));
  const auto robots = static_cast<RobotId>(std::max(1, std::atoi(argv[2])));
  if (graph.dimension != 3) throw std::invalid_argument("the graph is not 3D");

  // Without robots in the file, its poses count as those of robot 0. They are divided into blocks,
  // one for each robot.
  std::vector<BlockEdge> edges;
  KeyframeIndex poses = 0;
  for (const RelativePose& e : graph.edges) {
    const auto [kappa, tau] = precision_of(e.covariance);
    edges.push_back({e.from.index, e.to.index, e.T_from_to, kappa, tau});
    poses = std::max({poses, e.from.index + 1, e.to.index + 1});
  }
  const KeyframeIndex size = std::max(poses / robots, 1U);
  const auto id = [&](KeyframeIndex pose) {
    const KeyframeIndex robot = std::min<KeyframeIndex>(pose / size, robots - 1U);
    return KeyframeId{static_cast<RobotId>(robot), pose - robot * size};
  };

  // The start is the chordal initialisation of the whole graph, for simplicity. Robots in the field
  // start from their odometry.
  const std::vector<SE3> start = chordal_initialisation(poses, edges);
  std::vector<SessionGraph> parts(robots);
  for (RobotId k = 0; k < robots; ++k) parts[k].self = k;
  for (KeyframeIndex i = 0; i < poses; ++i) parts[id(i).robot].start.push_back(start[i]);

  // Both robots of an edge know it, and the pose of its other end. Steps of odometry come first.
  std::stable_sort(edges.begin(), edges.end(), [](auto& a, auto& b) { return a.i < b.i; });
  for (const BlockEdge& e : edges) {
    const auto i = static_cast<KeyframeIndex>(e.i), j = static_cast<KeyframeIndex>(e.j);
    const PoseEdge edge{id(i), id(j), e.T_i_j, {e.kappa, e.tau}};
    SessionGraph &from = parts[id(i).robot], &to = parts[id(j).robot];
    if (&from != &to) {
      from.between.push_back(edge);
      from.public_poses[edge.to] = start[j];
      to.between.push_back(edge);
      to.public_poses[edge.from] = start[i];
    } else if (j == i + 1 && edge.from.index == from.odometry) {
      from.own.insert(from.own.begin() + static_cast<std::ptrdiff_t>(from.odometry++), edge);
    } else {
      from.own.push_back(edge);
    }
  }

  // Messages pass along a tree: robot 0 is the root, and all others are its children.
  std::vector<std::unique_ptr<TreeNewton>> solvers;
  for (SessionGraph& part : parts) {
    std::sort(part.between.begin(), part.between.end(),
              [](auto& a, auto& b) { return a.id() < b.id(); });
    TreePlace place;
    for (RobotId k = 0; k < robots; ++k) place.members.push_back(k);
    if (part.self != 0) place.parent = 0;
    if (part.self == 0) place.children.assign(place.members.begin() + 1, place.members.end());
    // All edges are trusted. With `robust`, the team rejects false closures.
    solvers.push_back(
        std::make_unique<TreeNewton>(std::move(part), place, TreeNewtonOptions{.robust = false}));
  }

  std::size_t bytes = 0;
  const auto is_done = [](const auto& solver) { return solver->done(); };
  while (!std::all_of(solvers.begin(), solvers.end(), is_done))
    for (RobotId k = 0; k < robots; ++k) {
      if (!solvers[k]->ready()) continue;
      for (const SolverMessage& message : solvers[k]->advance()) {
        solvers[message.to]->receive(k, *message.bytes);
        bytes += message.bytes->size();
      }
    }

  const SolverState state = solvers[0]->state();
  std::cout << poses << " poses, " << robots << " robots, " << state.round << " rounds, " << bytes
            << " bytes, cost " << state.cost << '\n';
  std::ofstream out(argv[3]);
  double number = 0.0;  // in place of a time
  for (const auto& solver : solvers)
    for (const SE3& T_world_kf : solver->poses()) write_tum_row(out, number++, T_world_kf);
  return out.good() ? 0 : 1;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
