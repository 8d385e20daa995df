#include "modules/pose_graph/robust/gnc_team.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/rounding.hpp"

namespace km {
namespace {

// Edges and flags of one robot, in the order of the graph's edges as in part_of().
GncEdges edges_of(const TeamGraph& graph, std::size_t robot, const std::vector<bool>& odometry) {
  RobotPart part = part_of(graph, robot);
  GncEdges result{.edges = {static_cast<RobotId>(robot), part.poses, std::move(part.own_edges),
                            std::move(part.edges_to)}};
  for (std::size_t k = 0; k < graph.edges.size(); ++k) {
    const std::size_t a = graph.robot_of(graph.edges[k].i);
    const std::size_t b = graph.robot_of(graph.edges[k].j);
    if (a == robot && b == robot)
      result.own_odometry.push_back(odometry[k]);
    else if (a == robot || b == robot)
      result.odometry_to[static_cast<RobotId>(a == robot ? b : a)].push_back(odometry[k]);
  }
  return result;
}

}  // namespace

std::vector<bool> odometry_edges(const TeamGraph& graph) {
  std::vector<bool> odometry;
  std::set<KeyframeId> has_step;
  for (const BlockEdge& e : graph.edges) {
    const KeyframeId& from = graph.ids[static_cast<std::size_t>(e.i)];
    const KeyframeId& to = graph.ids[static_cast<std::size_t>(e.j)];
    const bool step = from.robot == to.robot && to.index == from.index + 1;
    odometry.push_back(step && has_step.insert(from).second);
  }
  return odometry;
}

GncTeam::GncTeam(const TeamGraph& graph, Eigen::Index rank, const LiftedPoses& start,
                 const GncAgentOptions& options)
    : graph_(graph), rank_(rank) {
  if (rank < 3) throw std::invalid_argument("GncTeam: rank is " + std::to_string(rank));
  if (start.size() > 0 && (start.rows() != rank || start.cols() != 4 * graph.poses()))
    throw std::invalid_argument("GncTeam: start poses are " + std::to_string(start.rows()) + 'x' +
                                std::to_string(start.cols()));
  std::set<RobotId> team;
  for (std::size_t k = 0; k < graph.robots(); ++k) team.insert(static_cast<RobotId>(k));
  const std::vector<bool> odometry = odometry_edges(graph);
  for (std::size_t k = 0; k < graph.robots(); ++k) {
    std::vector<SE3> poses;
    if (start.size() > 0)
      poses = round_to_poses(start.middleCols(4 * graph.first[k], 4 * graph.poses_of(k)),
                             lifted_identity(rank));
    agents_.emplace_back(edges_of(graph, k, odometry), team, graph.dimension, options,
                         std::move(poses));
    blocks_.push_back(lift(agents_[k].poses(), rank));
  }
}

bool GncTeam::step(RoundMeter& meter) {
  if (!met_) {
    met_ = true;
    std::vector<GncHello> hellos;
    for (std::size_t k = 0; k < agents_.size(); ++k) {
      hellos.push_back(meter.run(k, [&] { return agents_[k].hello(); }));
      meter.sent(hellos.back());
    }
    for (GncAgent& agent : agents_)
      for (const GncHello& hello : hellos) agent.receive(hello);
    return true;
  }
  bool worked = false;
  std::vector<std::shared_ptr<const GncShare>> shares;
  for (std::size_t k = 0; k < agents_.size(); ++k) {
    if (!agents_[k].ready()) continue;
    worked = true;
    auto share = meter.run(k, [&] { return agents_[k].advance(); });
    blocks_[k] = lift(agents_[k].poses(), rank_);
    if (!share) continue;
    meter.sent(*share);
    shares.push_back(std::make_shared<const GncShare>(std::move(*share)));
  }
  for (GncAgent& agent : agents_)
    for (const auto& share : shares) agent.receive(share);
  return worked;
}

std::vector<bool> GncTeam::kept() const {
  std::vector<bool> kept;
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> next;  // edge of a robot pair
  for (const BlockEdge& e : graph_.edges) {
    const std::pair<std::size_t, std::size_t> pair =
        std::minmax({graph_.robot_of(e.i), graph_.robot_of(e.j)});
    const auto [a, b] = pair;
    const std::size_t k = next[pair]++;
    kept.push_back(a == b ? agents_[a].kept_own(k) : agents_[a].kept(static_cast<RobotId>(b), k));
  }
  return kept;
}

}  // namespace km
