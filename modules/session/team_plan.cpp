#include "modules/session/team_plan.hpp"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "modules/core/geometry/precision.hpp"
#include "modules/session/team_tree.hpp"

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

// The robots that each robot agrees with, and the number of edges.
using Partners = std::map<RobotId, std::vector<std::pair<RobotId, std::uint32_t>>>;

Partners partners_of(const Agreements& agreements) {
  Partners partners;
  for (const auto& [pair, offer] : agreements) {
    partners[pair.first].emplace_back(pair.second, offer.edges);
    partners[pair.second].emplace_back(pair.first, offer.edges);
  }
  return partners;
}

std::set<RobotId> component_of(RobotId self, Partners& partners) {
  std::set<RobotId> component{self};
  std::vector<RobotId> open{self};
  while (!open.empty()) {
    const RobotId robot = open.back();
    open.pop_back();
    for (const auto& [other, edges] : partners[robot])
      if (component.insert(other).second) open.push_back(other);
  }
  return component;
}

void place_members(SessionPlan& plan, std::set<RobotId> waiting,
                   const std::map<RobotId, TeamStatus>& statuses, Partners& partners) {
  // Edges to the robots that are placed; for the first robot those to all others.
  std::map<RobotId, std::uint64_t> to_placed;
  for (const auto& [robot, others] : partners)
    for (const auto& [other, edges] : others) to_placed[robot] += edges;
  const auto place = [&](RobotId robot) {
    const TeamStatus& status = statuses.at(robot);
    plan.members.push_back(
        {.peer = status.sender, .revision = status.revision, .datum = status.datum});
    if (plan.members.size() == 1) to_placed.clear();
    for (const auto& [other, edges] : partners[robot]) to_placed[other] += edges;
    waiting.erase(robot);
  };
  while (!waiting.empty()) {
    const auto fewer = [&](RobotId x, RobotId y) { return to_placed[x] < to_placed[y]; };
    place(*std::max_element(waiting.begin(), waiting.end(), fewer));
  }
}

// Number of closures of each pair of a session of `plan`, made from `statuses`.
PairClosures closures_of(const SessionPlan& plan, const std::map<RobotId, TeamStatus>& statuses) {
  PairClosures closures;
  for (const SessionPair& pair : plan.pairs)
    for (const EdgeSetOffer& offer : statuses.at(pair.a).offers)
      if (offer.peer == pair.b && offer.id == pair.edges) closures[{pair.a, pair.b}] = offer.edges;
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

SessionPlan plan_session(const std::map<RobotId, TeamStatus>& statuses, RobotId self) {
  if (!statuses.contains(self))
    throw std::invalid_argument("plan_session: no status of robot " + std::to_string(self));
  const Agreements agreements = find_agreements(statuses);
  Partners partners = partners_of(agreements);
  const std::set<RobotId> members = component_of(self, partners);
  SessionPlan plan;
  for (const auto& [pair, offer] : agreements)
    if (members.contains(pair.first)) plan.pairs.push_back({pair.first, pair.second, offer.id});
  place_members(plan, members, statuses, partners);
  return plan;
}

void plan_tree(SessionPlan& plan, const std::map<RobotId, TeamStatus>& statuses,
               const TeamLinks& links) {
  std::set<RobotId> members;
  for (const SessionMember& member : plan.members) members.insert(member.peer.robot);
  const PairClosures closures = closures_of(plan, statuses);
  const RobotTree tree = choose_tree(members, closures, links);
  // The rounding of steps depends on the root, so measured quantities choose it.
  const auto rank = [&](RobotId robot) {
    std::uint64_t count = 0;
    for (const auto& [pair, edges] : closures)
      if (pair.first == robot || pair.second == robot) count += edges;
    return std::pair(count, statuses.at(robot).keyframes);
  };
  const auto [lower, upper] = centre_of(members, tree);
  const auto parents = parents_below(rank(upper) > rank(lower) ? upper : lower, tree);
  const std::map<RobotId, RobotId> parent_of(parents.begin(), parents.end());
  for (SessionMember& member : plan.members) {
    const auto parent = parent_of.find(member.peer.robot);
    member.parent = parent == parent_of.end() ? std::nullopt : std::optional(parent->second);
  }
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

bool is_well_formed(const SessionPlan& plan) {
  const auto ends = [](const SessionPair& pair) { return std::pair(pair.a, pair.b); };
  return !plan.members.empty() && place_in(plan, plan.members.front().peer.robot) &&
         std::ranges::adjacent_find(plan.pairs, std::ranges::greater_equal(), ends) ==
             plan.pairs.end() &&
         std::ranges::all_of(plan.pairs, [&](const SessionPair& pair) {
           return pair.a < pair.b && plan.has_member(pair.a) && plan.has_member(pair.b);
         });
}

bool same_graph(const SessionPlan& x, const SessionPlan& y) {
  return x.members.size() == y.members.size() && has_nothing_new(x, y);
}

bool has_nothing_new(const SessionPlan& session, const SessionPlan& now) {
  const auto was_member = [&](const SessionMember& member) {
    return std::ranges::any_of(session.members, [&](const SessionMember& before) {
      return before.peer == member.peer && before.revision == member.revision &&
             before.datum == member.datum;
    });
  };
  std::vector<SessionPair> pairs = session.pairs;
  std::erase_if(pairs, [&](const SessionPair& pair) {
    return !now.has_member(pair.a) || !now.has_member(pair.b);
  });
  return std::ranges::all_of(now.members, was_member) && pairs == now.pairs;
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
  for (const auto& [pair, count] : closures_of(plan, statuses)) closures += count;
  return closures;
}

RobotId coordinator_of(const SessionPlan& plan) {
  const auto lower = [](const SessionMember& x, const SessionMember& y) {
    return x.peer.robot < y.peer.robot;
  };
  return std::min_element(plan.members.begin(), plan.members.end(), lower)->peer.robot;
}

}  // namespace km
