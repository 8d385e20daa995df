// Solves a 3D pose graph by a team of robots. Each robot has only its part of the graph, and the
// robots exchange messages. Here all robots are in one process; in the field each is on a computer
// of its own, and the same messages cross a network.
//   solve_as_team GRAPH.g2o ROBOTS POSES.tum
#include <algorithm>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "modules/recorded_graph/g2o_io.hpp"
#include "modules/robust/tree_newton.hpp"
#include "modules/tree_newton/chordal.hpp"
#include "tum_row.hpp"

namespace km {
namespace {

// Divides the graph of one robot into parts of consecutive poses, one for each robot of the team.
// The start is the chordal initialisation of the whole graph, for simplicity. Robots in the field
// start from their odometry.
std::vector<SessionGraph> divide(const G2oGraph& graph, RobotId robots) {
  if (graph.dimension != 3) throw std::invalid_argument("the graph is not 3D");
  std::vector<PoseEdge> edges;
  KeyframeIndex poses = 0;
  for (const RelativePose& e : graph.edges) {
    if (e.from.robot != 0 || e.to.robot != 0) throw std::invalid_argument("the graph has robots");
    edges.push_back({e.from, e.to, e.T_from_to, precision_of(e.covariance)});
    poses = std::max({poses, e.from.index + 1, e.to.index + 1});
  }
  if (robots == 0 || robots > poses) throw std::invalid_argument("no poses for so many robots");
  const auto id = [&](KeyframeIndex pose) {
    const KeyframeIndex robot = std::min<KeyframeIndex>(pose / (poses / robots), robots - 1U);
    return KeyframeId{static_cast<RobotId>(robot), pose - robot * (poses / robots)};
  };

  const std::vector<SE3> start = chordal_initialisation(poses, edges);
  std::vector<SessionGraph> parts(robots);
  for (RobotId k = 0; k < robots; ++k) parts[k].self = k;
  for (KeyframeIndex i = 0; i < poses; ++i) parts[id(i).robot].start.push_back(start[i]);

  // Steps of odometry come first among the own edges of a robot. Both robots of an edge between
  // robots have this edge, and the pose of its other end.
  std::stable_sort(edges.begin(), edges.end(), [](auto& a, auto& b) { return a.from < b.from; });
  for (const PoseEdge& e : edges) {
    const KeyframeIndex i = e.from.index, j = e.to.index;
    const PoseEdge edge{id(i), id(j), e.T_from_to, e.precision};
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
  for (SessionGraph& part : parts)
    std::stable_sort(part.between.begin(), part.between.end(),
                     [](auto& a, auto& b) { return a.id() < b.id(); });
  return parts;
}

int run(int argc, char** argv) {
  if (argc != 4) throw std::invalid_argument("usage: solve_as_team GRAPH.g2o ROBOTS POSES.tum");
  const auto robots = static_cast<RobotId>(std::atoi(argv[2]));

  // Messages pass along a tree: robot 0 is the root, and all others are its children. Here all
  // edges are trusted; if `robust` is true, the team rejects false closures.
  std::vector<std::unique_ptr<TreeNewton>> solvers;
  for (SessionGraph& part : divide(read_g2o(std::filesystem::path(argv[1])), robots)) {
    TreePlace place;
    for (RobotId k = 0; k < robots; ++k) place.members.push_back(k);
    if (part.self != 0) place.parent = 0;
    if (part.self == 0) place.children.assign(place.members.begin() + 1, place.members.end());
    solvers.push_back(std::make_unique<TreeNewton>(std::move(part), std::move(place),
                                                   TreeNewtonOptions{.robust = false}));
  }

  // A message passes as bytes from advance() of its sender to receive() of its receiver.
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

  std::ofstream out(argv[3]);
  double number = 0.0;  // in place of a time
  for (const auto& solver : solvers)
    for (const SE3& T_world_kf : solver->poses()) write_tum_row(out, number++, T_world_kf);
  const SolverState state = solvers[0]->state();
  std::cout << number << " poses, " << robots << " robots, " << state.round << " rounds, " << bytes
            << " bytes, cost " << state.cost << '\n';
  return out.good() ? 0 : 1;
}

}  // namespace
}  // namespace km

int main(int argc, char** argv) try {
  return km::run(argc, argv);
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
