#include "modules/session/team_tree.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <tuple>

namespace km {
namespace {

// The spanning tree has more closures between children and parents. Parents weigh these, which
// saves second derivatives, so that the elimination tree must be much better by the estimate.
constexpr double kMuchFewer = 0.5;

struct TreeEdge {
  std::size_t hops = 1;
  std::uint32_t closures = 0;
  RobotId a = 0;
  RobotId b = 0;
  [[nodiscard]] bool before(const TreeEdge& other) const {
    return std::tie(hops, other.closures, a, b) < std::tie(other.hops, closures, other.a, other.b);
  }
};

// Candidate edges of the tree between linked robots, or also between robots without a link; best
// first.
std::vector<TreeEdge> possible_tree_edges(const std::set<RobotId>& robots,
                                          const PairClosures& closures, const TeamLinks& links,
                                          bool linked_only) {
  constexpr std::size_t kNoPath = std::numeric_limits<std::size_t>::max();
  std::vector<TreeEdge> possible;
  for (const RobotId a : robots) {
    std::map<RobotId, std::size_t> distances;
    if (!linked_only) distances = links.distances(a);
    for (auto b = robots.upper_bound(a); b != robots.end(); ++b) {
      const bool linked = links.linked(a, *b);
      if (linked_only && !linked) continue;
      const auto distance = distances.find(*b);
      const auto between = closures.find({a, *b});
      possible.push_back({.hops = linked                        ? 1
                                  : distance == distances.end() ? kNoPath
                                                                : distance->second,
                          .closures = between == closures.end() ? 0 : between->second,
                          .a = a,
                          .b = *b});
    }
  }
  std::sort(possible.begin(), possible.end(),
            [](const TreeEdge& x, const TreeEdge& y) { return x.before(y); });
  return possible;
}

void join(RobotTree& tree, RobotId a, RobotId b) {
  tree[a].push_back(b);
  tree[b].push_back(a);
}

RobotTree spanning_tree(const std::set<RobotId>& robots, const PairClosures& closures,
                        const TeamLinks& links) {
  std::map<RobotId, RobotId> part_of;  // a part is identified by one of its robots
  for (const RobotId robot : robots) part_of[robot] = robot;
  RobotTree tree;
  std::size_t parts = robots.size();
  for (const bool linked_only : {true, false}) {
    if (parts == 1) break;
    for (const TreeEdge& e : possible_tree_edges(robots, closures, links, linked_only)) {
      const RobotId absorbed = part_of.at(e.a);
      const RobotId into = part_of.at(e.b);
      if (absorbed == into) continue;
      for (auto& [robot, part] : part_of)
        if (part == absorbed) part = into;
      join(tree, e.a, e.b);
      --parts;
    }
  }
  return tree;
}

// Robots that are eliminated, or one that is not: its closures to each robot that is not.
struct Subtree {
  RobotId root = 0;
  std::size_t depth = 0;
  std::map<RobotId, std::uint64_t> closures = {};
};

// The subtree of `robot` if it is eliminated next: with all subtrees that have closures to it.
Subtree subtree_of(RobotId robot, const std::map<RobotId, Subtree>& own,
                   const std::vector<Subtree>& done) {
  Subtree merged = own.at(robot);
  for (const Subtree& below : done)
    if (below.closures.contains(robot)) {
      merged.depth = std::max(merged.depth, below.depth + 1);
      for (const auto& [other, count] : below.closures)
        if (other != robot) merged.closures[other] += count;
    }
  return merged;
}

std::uint64_t cut_of(const Subtree& subtree) {
  std::uint64_t cut = 0;
  for (const auto& [robot, count] : subtree.closures) cut += count;
  return cut;
}

// The robot, its parent, and so on up to the root.
std::vector<RobotId> path_up(RobotId robot, const std::map<RobotId, RobotId>& parent_of) {
  std::vector<RobotId> path{robot};
  for (auto parent = parent_of.find(robot); parent != parent_of.end();
       parent = parent_of.find(path.back()))
    path.push_back(parent->second);
  return path;
}

// Messages over all edges of the tree, in units of the second derivatives of one closure.
double messages_of(const RobotTree& tree, const std::set<RobotId>& robots,
                   const PairClosures& closures, const TeamLinks& links) {
  // With 6 unknowns per closure: second derivatives are 6 x 6 / 2 x 4 bytes times the square, sent
  // once or twice. A gradient and a step have 6 x (8 + 4) bytes, in about 25 rounds.
  constexpr double kGradients = 25.0;
  const auto parents = parents_below(centre_of(robots, tree).first, tree);
  const std::map<RobotId, RobotId> parent_of(parents.begin(), parents.end());
  std::map<RobotId, std::uint64_t> cut;  // on the edge to the parent
  for (const auto& [pair, count] : closures) {
    std::vector<RobotId> a = path_up(pair.first, parent_of);
    std::vector<RobotId> b = path_up(pair.second, parent_of);
    // Below the first common robot are the edges on the path between the two.
    while (!a.empty() && !b.empty() && a.back() == b.back()) {
      a.pop_back();
      b.pop_back();
    }
    for (const std::vector<RobotId>& side : {a, b})
      for (const RobotId robot : side) cut[robot] += count;
  }
  double messages = 0.0;
  for (const auto& [robot, parent] : parents) {
    const auto closures_over = static_cast<double>(cut[robot]);
    double hops = 1.0;
    if (!links.linked(robot, parent)) {
      const auto distances = links.distances(robot);
      const auto distance = distances.find(parent);
      hops = static_cast<double>(distance == distances.end() ? robots.size() : distance->second);
    }
    messages += hops * (closures_over * closures_over + kGradients * closures_over);
  }
  return messages;
}

}  // namespace

RobotTree choose_tree(const std::set<RobotId>& robots, const PairClosures& closures,
                      const TeamLinks& links) {
  RobotTree spanning = spanning_tree(robots, closures, links);
  RobotTree elimination = elimination_tree(robots, closures);
  const bool fewer = messages_of(elimination, robots, closures, links) <
                     kMuchFewer * messages_of(spanning, robots, closures, links);
  return fewer ? elimination : spanning;
}

RobotTree elimination_tree(const std::set<RobotId>& robots, const PairClosures& closures) {
  std::map<RobotId, Subtree> open;
  for (const RobotId robot : robots) open[robot].root = robot;
  for (const auto& [pair, count] : closures) {
    open.at(pair.first).closures[pair.second] += count;
    open.at(pair.second).closures[pair.first] += count;
  }
  RobotTree tree;
  std::vector<Subtree> done;
  while (!open.empty()) {
    Subtree next;
    std::optional<std::pair<std::uint64_t, std::size_t>> best;
    for (const auto& [robot, own] : open) {
      Subtree subtree = subtree_of(robot, open, done);
      const std::pair cost(cut_of(subtree), subtree.depth);
      if (best && *best <= cost) continue;
      best = cost;
      next = std::move(subtree);
    }
    std::erase_if(done, [&](const Subtree& below) {
      const bool child = below.closures.contains(next.root);
      if (child) join(tree, below.root, next.root);
      return child;
    });
    open.erase(next.root);
    for (auto& [robot, own] : open) own.closures.erase(next.root);
    done.push_back(std::move(next));
  }
  return tree;
}

std::vector<std::pair<RobotId, RobotId>> parents_below(RobotId root, const RobotTree& tree) {
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

// The middle of a longest path. From any robot, the farthest one is an end of such a path.
std::pair<RobotId, RobotId> centre_of(const std::set<RobotId>& robots, const RobotTree& tree) {
  const auto path_to_farthest = [&](RobotId from) {
    const auto parents = parents_below(from, tree);
    const std::map<RobotId, RobotId> parent_of(parents.begin(), parents.end());
    return path_up(parents.empty() ? from : parents.back().first, parent_of);
  };
  const std::vector<RobotId> longest = path_to_farthest(path_to_farthest(*robots.begin()).front());
  return std::minmax(longest[(longest.size() - 1) / 2], longest[longest.size() / 2]);
}

}  // namespace km
