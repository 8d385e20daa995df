#include "modules/pose_graph/newton/newton_team.hpp"

#include <numeric>
#include <stdexcept>
#include <string>

#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/rounding.hpp"

namespace km {
namespace {

void check_connected(const TeamGraph& graph) {
  std::vector<Eigen::Index> root(static_cast<std::size_t>(graph.poses()));
  std::iota(root.begin(), root.end(), Eigen::Index{0});
  const auto find = [&](Eigen::Index v) {
    while (root[static_cast<std::size_t>(v)] != v) {
      auto& up = root[static_cast<std::size_t>(v)];
      v = up = root[static_cast<std::size_t>(up)];
    }
    return v;
  };
  Eigen::Index parts = graph.poses();
  for (const BlockEdge& e : graph.edges) {
    const Eigen::Index i = find(e.i);
    const Eigen::Index j = find(e.j);
    if (i == j) continue;
    root[static_cast<std::size_t>(i)] = j;
    --parts;
  }
  if (parts != 1)
    throw std::invalid_argument("NewtonTeam: the graph falls into " + std::to_string(parts) +
                                " parts");
}

}  // namespace

NewtonTeam::NewtonTeam(const TeamGraph& graph, Eigen::Index rank, const LiftedPoses& start,
                       NewtonOptions options)
    : rank_(rank) {
  if (rank < 3) throw std::invalid_argument("NewtonTeam: rank is " + std::to_string(rank));
  if (start.size() > 0 && (start.rows() != rank || start.cols() != 4 * graph.poses()))
    throw std::invalid_argument("NewtonTeam: start poses are " + std::to_string(start.rows()) +
                                'x' + std::to_string(start.cols()));
  check_connected(graph);
  options.upright = !graph.verticals.empty();
  std::set<RobotId> team;
  for (std::size_t k = 0; k < graph.robots(); ++k) team.insert(static_cast<RobotId>(k));
  for (std::size_t k = 0; k < graph.robots(); ++k) {
    RobotPart part = part_of(graph, k);
    std::vector<SE3> poses(static_cast<std::size_t>(part.poses), SE3::Identity());
    blocks_.push_back(lift(poses, rank));
    if (start.size() > 0) {
      blocks_.back() = start.middleCols(4 * graph.first[k], 4 * part.poses);
      poses = round_to_poses(blocks_.back(), lifted_identity(rank));
    } else {
      poses.clear();
    }
    agents_.emplace_back(RobotEdges{static_cast<RobotId>(k), part.poses, std::move(part.own_edges),
                                    std::move(part.edges_to), std::move(part.verticals)},
                         team, graph.dimension, options, std::move(poses));
  }
}

bool NewtonTeam::step(RoundMeter& meter) {
  if (!met_) {
    met_ = true;
    std::vector<NewtonHello> hellos;
    for (std::size_t k = 0; k < agents_.size(); ++k) {
      hellos.push_back(meter.run(k, [&] { return agents_[k].hello(); }));
      meter.sent(hellos.back());
    }
    for (NewtonAgent& agent : agents_)
      for (const NewtonHello& hello : hellos) agent.receive(hello);
    return true;
  }
  bool worked = false;
  std::vector<std::shared_ptr<const NewtonShare>> shares;
  for (std::size_t k = 0; k < agents_.size(); ++k) {
    if (!agents_[k].ready()) continue;
    worked = true;
    auto share = meter.run(k, [&] { return agents_[k].advance(); });
    if (!agents_[k].poses().empty()) blocks_[k] = lift(agents_[k].poses(), rank_);
    if (!share) continue;
    meter.sent(*share);
    shares.push_back(std::make_shared<const NewtonShare>(std::move(*share)));
  }
  for (NewtonAgent& agent : agents_)
    for (const auto& share : shares) agent.receive(share);
  return worked;
}

}  // namespace km
