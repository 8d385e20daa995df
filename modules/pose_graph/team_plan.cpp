#include "modules/pose_graph/team_plan.hpp"

#include <algorithm>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "modules/core/precision.hpp"

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

using Tree = std::map<RobotId, std::vector<RobotId>>;  // neighbours

struct TreeEdge {
  std::size_t hops = 1;
  std::uint32_t edges = 0;
  RobotId a = 0;
  RobotId b = 0;
  [[nodiscard]] bool before(const TreeEdge& other) const {
    return std::tie(hops, other.edges, a, b) < std::tie(other.hops, edges, other.a, other.b);
  }
};

// Candidate edges of the tree between linked members, or also between members without a link; best
// first.
std::vector<TreeEdge> possible_tree_edges(const std::set<RobotId>& members,
                                          const Agreements& agreements, const TeamLinks& links,
                                          bool linked_only) {
  constexpr std::size_t kNoPath = std::numeric_limits<std::size_t>::max();
  std::vector<TreeEdge> possible;
  for (const RobotId a : members) {
    std::map<RobotId, std::size_t> distances;
    if (!linked_only) distances = links.distances(a);
    for (auto b = members.upper_bound(a); b != members.end(); ++b) {
      const bool linked = links.linked(a, *b);
      if (linked_only && !linked) continue;
      const auto distance = distances.find(*b);
      const auto agreed = agreements.find({a, *b});
      possible.push_back({.hops = linked                        ? 1
                                  : distance == distances.end() ? kNoPath
                                                                : distance->second,
                          .edges = agreed == agreements.end() ? 0 : agreed->second.edges,
                          .a = a,
                          .b = *b});
    }
  }
  std::sort(possible.begin(), possible.end(),
            [](const TreeEdge& x, const TreeEdge& y) { return x.before(y); });
  return possible;
}

Tree spanning_tree(const std::set<RobotId>& members, const Agreements& agreements,
                   const TeamLinks& links) {
  std::map<RobotId, RobotId> part_of;  // a part is identified by one of its robots
  for (const RobotId robot : members) part_of[robot] = robot;
  Tree tree;
  std::size_t parts = members.size();
  for (const bool linked_only : {true, false}) {
    if (parts == 1) break;
    for (const TreeEdge& e : possible_tree_edges(members, agreements, links, linked_only)) {
      const RobotId absorbed = part_of.at(e.a);
      const RobotId into = part_of.at(e.b);
      if (absorbed == into) continue;
      for (auto& [robot, part] : part_of)
        if (part == absorbed) part = into;
      tree[e.a].push_back(e.b);
      tree[e.b].push_back(e.a);
      --parts;
    }
  }
  return tree;
}

// Parents of all robots connected to `root`, in order of their depth.
std::vector<std::pair<RobotId, RobotId>> parents_below(RobotId root, const Tree& tree) {
  std::vector<std::pair<RobotId, RobotId>> parents;
  std::vector<std::pair<RobotId, RobotId>> open{{root, root}};
  for (std::size_t k = 0; k < open.size(); ++k) {
    const auto [robot, parent] = open[k];
    if (k > 0) parents.emplace_back(robot, parent);
    const auto neighbours = tree.find(robot);
    if (neighbours == tree.end()) continue;
    for (const RobotId neighbour : neighbours->second)
      if (neighbour != parent || k == 0) open.emplace_back(neighbour, robot);
  }
  return parents;
}

std::size_t depth_below(RobotId root, const Tree& tree) {
  std::map<RobotId, std::size_t> depth{{root, 0}};
  std::size_t deepest = 0;
  for (const auto& [robot, parent] : parents_below(root, tree))
    deepest = std::max(deepest, depth[robot] = depth.at(parent) + 1);
  return deepest;
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
  const Tree tree = spanning_tree(members, agreements, links);
  std::map<std::size_t, RobotId> root_of_depth;
  for (const RobotId robot : members) root_of_depth.try_emplace(depth_below(robot, tree), robot);
  const auto parents = parents_below(root_of_depth.begin()->second, tree);
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
  Tree children;
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
