#include "modules/pose_graph/session_plan.hpp"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>

namespace km {
namespace {

using Links = std::map<std::pair<RobotId, RobotId>, EdgeSetOffer>;  // a < b

Links find_links(const std::map<RobotId, PgoStatus>& statuses) {
  Links links;
  for (auto a = statuses.begin(); a != statuses.end(); ++a)
    for (auto b = std::next(a); b != statuses.end(); ++b)
      if (const auto agreed = agreed_edges(a->second, b->second))
        links.emplace(std::pair(a->first, b->first), *agreed);
  return links;
}

std::set<RobotId> component_of(RobotId self, const Links& links) {
  std::set<RobotId> component{self};
  for (bool grown = true; grown;) {
    grown = false;
    for (const auto& [pair, offer] : links)
      if (component.contains(pair.first) != component.contains(pair.second)) {
        component.insert({pair.first, pair.second});
        grown = true;
      }
  }
  return component;
}

// Edges between `robot` and the robots of `others`.
std::uint64_t edges_to(RobotId robot, const std::set<RobotId>& others, const Links& links) {
  std::uint64_t edges = 0;
  for (const auto& [pair, offer] : links)
    if ((pair.first == robot && others.contains(pair.second)) ||
        (pair.second == robot && others.contains(pair.first)))
      edges += offer.edges;
  return edges;
}

PgoFrame choose_frame(const std::set<RobotId>& members,
                      const std::map<RobotId, PgoStatus>& statuses, const Links& links) {
  struct Support {
    std::uint64_t robots = 0;
    std::uint64_t edges = 0;
  };
  std::map<PgoFrame, Support> support;
  for (const RobotId robot : members) {
    Support& of_frame = support[statuses.at(robot).frame];
    ++of_frame.robots;
    of_frame.edges += edges_to(robot, members, links);
  }
  const auto less = [](const auto& x, const auto& y) {
    return std::tie(x.second.robots, x.second.edges) < std::tie(y.second.robots, y.second.edges);
  };
  return std::max_element(support.begin(), support.end(), less)->first;
}

}  // namespace

std::optional<EdgeSetOffer> agreed_edges(const PgoStatus& a, const PgoStatus& b) {
  std::optional<EdgeSetOffer> agreed;
  for (const EdgeSetOffer& x : a.offers)
    for (const EdgeSetOffer& y : b.offers)
      if (x.peer == b.sender.robot && y.peer == a.sender.robot && x.id == y.id &&
          x.edges == y.edges && (!agreed || agreed->id.version < x.id.version))
        agreed = x;
  return agreed;
}

SessionPlan plan_session(const std::map<RobotId, PgoStatus>& statuses, RobotId self) {
  if (!statuses.contains(self))
    throw std::invalid_argument("plan_session: no status of robot " + std::to_string(self));
  const Links links = find_links(statuses);
  std::set<RobotId> waiting = component_of(self, links);
  SessionPlan plan{choose_frame(waiting, statuses, links), {}, {}};
  for (const auto& [pair, offer] : links)
    if (waiting.contains(pair.first)) plan.pairs.push_back({pair.first, pair.second, offer.id});
  std::set<RobotId> placed;
  const auto place = [&](RobotId robot) {
    const PgoStatus& status = statuses.at(robot);
    plan.members.push_back({status.sender, status.revision});
    placed.insert(robot);
    waiting.erase(robot);
  };
  for (const auto& [robot, status] : statuses)
    if (waiting.contains(robot) && status.frame == plan.frame) place(robot);
  while (!waiting.empty()) {
    const auto fewer = [&](RobotId x, RobotId y) {
      return edges_to(x, placed, links) < edges_to(y, placed, links);
    };
    place(*std::max_element(waiting.begin(), waiting.end(), fewer));
  }
  return plan;
}

std::uint64_t closures_known(const SessionPlan& plan,
                             const std::map<RobotId, PgoStatus>& statuses) {
  std::uint64_t known = 0;
  for (const SessionPair& pair : plan.pairs)
    for (const EdgeSetOffer& offer : statuses.at(pair.a).offers)
      if (offer.peer == pair.b && offer.id == pair.edges) known += offer.edges;
  for (const SessionMember& member : plan.members) {
    const PgoStatus& status = statuses.at(member.peer.robot);
    known += status.revision - std::min(status.revision, status.keyframes);
  }
  return known;
}

RobotId coordinator_of(const SessionPlan& plan) {
  const auto lower = [](const SessionMember& x, const SessionMember& y) {
    return x.peer.robot < y.peer.robot;
  };
  return std::min_element(plan.members.begin(), plan.members.end(), lower)->peer.robot;
}

}  // namespace km
