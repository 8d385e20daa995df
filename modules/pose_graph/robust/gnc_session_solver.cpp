#include "modules/pose_graph/robust/gnc_session_solver.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace km {
namespace {

constexpr int kDimension = 3;

std::size_t odometry_of(const RobotEdges& edges) {
  return edges.poses > 0 ? static_cast<std::size_t>(edges.poses) - 1 : 0;
}

// Closures between robots are never odometry here.
GncEdges with_flags(RobotEdges edges) {
  GncEdges result;
  for (std::size_t k = 0; k < edges.own.size(); ++k)
    result.own_odometry.push_back(k < odometry_of(edges));
  for (const auto& [peer, list] : edges.to) result.odometry_to[peer].assign(list.size(), false);
  result.edges = std::move(edges);
  return result;
}

}  // namespace

GncSessionSolver::GncSessionSolver(RobotEdges edges, std::set<RobotId> members,
                                   std::vector<SE3> start, double barc)
    : agent_(with_flags(std::move(edges)), std::move(members), kDimension,
             GncAgentOptions{.gnc = {.barc = barc}}, std::move(start)) {}

void GncSessionSolver::receive(const SolverMessagePtr& message) {
  if (const auto* hello = std::get_if<GncHello>(&message->content)) agent_.receive(*hello);
  if (const auto* share = std::get_if<GncShare>(&message->content))
    agent_.receive(std::shared_ptr<const GncShare>(message, share));
}

std::optional<SolverContent> GncSessionSolver::advance() {
  if (auto share = agent_.advance()) return std::move(*share);
  return std::nullopt;
}

SolverProgress GncSessionSolver::progress() const {
  return {agent_.cost(), std::sqrt(std::max(0.0, agent_.decrement()))};
}

ClosureVerdicts GncSessionSolver::verdicts() const {
  const RobotEdges& edges = agent_.edges().edges;
  ClosureVerdicts verdicts;
  for (std::size_t k = odometry_of(edges); k < edges.own.size(); ++k)
    verdicts.closures.push_back({closure_id(edges.self, edges.own[k]), agent_.kept_own(k)});
  for (const auto& [peer, list] : edges.to)
    for (std::size_t k = 0; k < list.size(); ++k)
      verdicts.closures.push_back({closure_id(edges.self, peer, list[k]), agent_.kept(peer, k)});
  return verdicts;
}

}  // namespace km
