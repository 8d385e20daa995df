#include "modules/pose_graph/team_plan.hpp"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "modules/core/precision.hpp"
#include "modules/pose_graph/team_tree.hpp"

namespace km {
namespace {

using Agreements = std::map<std::pair<RobotId, RobotId>, EdgeSetOffer>;  // a < b

Agreements find_agreements(const std::map<RobotId, TeamStatus>& statuses) {
  Agreements agreements;
  for (const auto& [a, status] : statuses) {
    std::optional<RobotId> last;
    for (const EdgeSetOffer& offer : status.offers) {
      const auto other = statuses.find(offer.peer);
      if (offer.peer <= a || offer.peer == last || other == statuses.end()) continue;
      last = offer.peer;
      if (const auto agreed = agreed_edges(status, other->second))
        agreements.emplace(std::pair(a, offer.peer), *agreed);
    }
  }
  return agreements;
}

std::set<RobotId> component_of(RobotId self, const Agreements& agreements) {
  std::set<RobotId> component{self};
  for (bool grown = true; grown;) {
    grown = false;
    for (const auto& [pair, offer] : agreements)
      if (component.contains(pair.first) != component.contains(pair.second)) {
        component.insert({pair.first, pair.second});
        grown = true;
      }
  }
  return component;
}

// Number of edges between `robot` and the robots of `others`.
std::uint64_t edges_to(RobotId robot, const std::set<RobotId>& others,
                       const Agreements& agreements) {
  std::uint64_t edges = 0;
  for (const auto& [pair, offer] : agreements)
    if ((pair.first == robot && others.contains(pair.second)) ||
        (pair.second == robot && others.contains(pair.first)))
      edges += offer.edges;
  return edges;
}

TeamFrame choose_frame(const std::set<RobotId>& members,
                       const std::map<RobotId, TeamStatus>& statuses,
                       const Agreements& agreements) {
  struct Support {
    std::uint64_t robots = 0;
    std::uint64_t edges = 0;
  };
  std::map<TeamFrame, Support> support;
  for (const RobotId robot : members) {
    Support& of_frame = support[statuses.at(robot).frame];
    ++of_frame.robots;
    of_frame.edges += edges_to(robot, members, agreements);
  }
  const auto less = [](const auto& x, const auto& y) {
    return std::tie(x.second.robots, x.second.edges) < std::tie(y.second.robots, y.second.edges);
  };
  return std::max_element(support.begin(), support.end(), less)->first;
}

void place_members(SessionPlan& plan, std::set<RobotId> waiting,
                   const std::map<RobotId, TeamStatus>& statuses, const Agreements& agreements) {
  std::set<RobotId> placed;
  const auto place = [&](RobotId robot) {
    const TeamStatus& status = statuses.at(robot);
    plan.members.push_back(
        {.peer = status.sender, .revision = status.revision, .datum = status.datum});
    placed.insert(robot);
    waiting.erase(robot);
  };
  for (const auto& [robot, status] : statuses)
    if (waiting.contains(robot) && status.frame == plan.frame) place(robot);
  while (!waiting.empty()) {
    const auto fewer = [&](RobotId x, RobotId y) {
      return edges_to(x, placed, agreements) < edges_to(y, placed, agreements);
    };
    place(*std::max_element(waiting.begin(), waiting.end(), fewer));
  }
}

PairClosures closures_of(const std::set<RobotId>& members, const Agreements& agreements) {
  PairClosures closures;
  for (const auto& [pair, offer] : agreements)
    if (members.contains(pair.first)) closures[pair] = offer.edges;
  return closures;
}

}  // namespace

std::optional<EdgeSetOffer> agreed_edges(const TeamStatus& a, const TeamStatus& b) {
  std::optional<EdgeSetOffer> agreed;
  for (const EdgeSetOffer& x : a.offers) {
    if (x.peer != b.sender.robot) continue;
    for (const EdgeSetOffer& y : b.offers)
      if (y.peer == a.sender.robot && x.id == y.id && x.edges == y.edges &&
          (!agreed || agreed->id.version < x.id.version))
        agreed = x;
  }
  return agreed;
}

SessionPlan plan_session(const std::map<RobotId, TeamStatus>& statuses, const TeamLinks& links,
                         RobotId self) {
  if (!statuses.contains(self))
    throw std::invalid_argument("plan_session: no status of robot " + std::to_string(self));
  const Agreements agreements = find_agreements(statuses);
  const std::set<RobotId> members = component_of(self, agreements);
  SessionPlan plan{choose_frame(members, statuses, agreements), {}, {}};
  for (const auto& [pair, offer] : agreements)
    if (members.contains(pair.first)) plan.pairs.push_back({pair.first, pair.second, offer.id});
  place_members(plan, members, statuses, agreements);
  const RobotTree tree = choose_tree(members, closures_of(members, agreements), links);
  const auto parents = parents_below(centre_of(members, tree), tree);
  const std::map<RobotId, RobotId> parent_of(parents.begin(), parents.end());
  for (SessionMember& member : plan.members)
    if (const auto parent = parent_of.find(member.peer.robot); parent != parent_of.end())
      member.parent = parent->second;
  return plan;
}

std::vector<PoseEdge> datum_ties(const SessionPlan& plan, RobotId robot) {
  constexpr double kRotation_rad = 1e-5, kTranslation_m = 1e-3;
  constexpr Precision kRigid{.kappa = 0.5 / (kRotation_rad * kRotation_rad),
                             .tau = 1.0 / (kTranslation_m * kTranslation_m)};
  std::map<std::uint64_t, RobotId> lowest;
  for (const SessionMember& member : plan.members) {
    const auto first = lowest.try_emplace(member.datum, member.peer.robot).first;
    first->second = std::min(first->second, member.peer.robot);
  }
  lowest.erase(0);
  std::vector<PoseEdge> ties;
  for (const SessionMember& member : plan.members) {
    const auto first = lowest.find(member.datum);
    if (first == lowest.end() || first->second == member.peer.robot) continue;
    if (first->second == robot || member.peer.robot == robot)
      ties.push_back({{first->second, 0}, {member.peer.robot, 0}, SE3::Identity(), kRigid});
  }
  std::ranges::sort(ties, {}, &PoseEdge::id);
  return ties;
}

std::optional<TreePlace> place_in(const SessionPlan& plan, RobotId robot) {
  TreePlace place;
  RobotTree children;
  std::size_t roots = 0;
  for (const SessionMember& member : plan.members) {
    place.members.push_back(member.peer.robot);
    if (member.peer.robot == robot) place.parent = member.parent;
    if (member.parent) {
      children[*member.parent].push_back(member.peer.robot);
    } else {
      place.root = member.peer.robot;
      ++roots;
    }
  }
  std::sort(place.members.begin(), place.members.end());
  const bool twice =
      std::adjacent_find(place.members.begin(), place.members.end()) != place.members.end();
  const bool member = std::binary_search(place.members.begin(), place.members.end(), robot);
  // With one root and each robot once, either the root reaches all robots, or there is a cycle.
  if (roots != 1 || twice || !member ||
      parents_below(place.root, children).size() + 1 != place.members.size())
    return std::nullopt;
  place.children = children[robot];
  std::sort(place.children.begin(), place.children.end());
  return place;
}

bool same_graph(const SessionPlan& x, const SessionPlan& y) {
  const auto same = [](const SessionMember& a, const SessionMember& b) {
    return a.peer == b.peer && a.revision == b.revision && a.datum == b.datum;
  };
  return x.pairs == y.pairs && std::is_permutation(x.members.begin(), x.members.end(),
                                                   y.members.begin(), y.members.end(), same);
}

bool has_lost_member(const SessionPlan& session, const SessionPlan& now) {
  return std::any_of(session.members.begin(), session.members.end(), [&](const auto& member) {
    return std::none_of(now.members.begin(), now.members.end(),
                        [&](const auto& other) { return other.peer == member.peer; });
  });
}

std::uint64_t closures_between(const SessionPlan& plan,
                               const std::map<RobotId, TeamStatus>& statuses) {
  std::uint64_t closures = 0;
  for (const SessionPair& pair : plan.pairs)
    for (const EdgeSetOffer& offer : statuses.at(pair.a).offers)
      if (offer.peer == pair.b && offer.id == pair.edges) closures += offer.edges;
  return closures;
}

RobotId coordinator_of(const SessionPlan& plan) {
  const auto lower = [](const SessionMember& x, const SessionMember& y) {
    return x.peer.robot < y.peer.robot;
  };
  return std::min_element(plan.members.begin(), plan.members.end(), lower)->peer.robot;
}

}  // namespace km
