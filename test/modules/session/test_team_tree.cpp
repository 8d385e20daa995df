#include <catch2/catch.hpp>

#include <algorithm>
#include <random>

#include "modules/session/team_tree.hpp"

namespace km {
namespace {

using Parents = std::map<RobotId, RobotId>;

std::set<RobotId> first_robots(RobotId count) {
  std::set<RobotId> robots;
  for (RobotId robot = 0; robot < count; ++robot) robots.insert(robot);
  return robots;
}

TeamLinks links_among(const std::set<RobotId>& robots) {
  TeamLinks links;
  for (const RobotId robot : robots) {
    std::set<RobotId> others = robots;
    others.erase(robot);
    (void)links.report(robot, others);
  }
  return links;
}

// Robots on a ring with 24 closures to each of the two robots before and after them.
PairClosures ring_of(RobotId robots) {
  PairClosures closures;
  for (RobotId robot = 0; robot < robots; ++robot)
    for (const RobotId beside : std::vector<RobotId>{1, 2}) {
      const auto other = static_cast<RobotId>((robot + beside) % robots);
      closures[std::pair(std::min(robot, other), std::max(robot, other))] = 24;
    }
  return closures;
}

Parents parents_of(const std::set<RobotId>& robots, const RobotTree& tree) {
  const auto parents = parents_below(centre_of(robots, tree).first, tree);
  return {parents.begin(), parents.end()};
}

bool is_above(RobotId above, RobotId robot, const Parents& parents) {
  for (auto at = parents.find(robot); at != parents.end(); at = parents.find(at->second))
    if (at->second == above) return true;
  return false;
}

// Number of closures that cross the edge from `robot` to its parent.
std::uint32_t closures_over(RobotId robot, const Parents& parents, const PairClosures& closures) {
  const auto below = [&](RobotId x) { return x == robot || is_above(robot, x, parents); };
  std::uint32_t sum = 0;
  for (const auto& [pair, count] : closures)
    if (below(pair.first) != below(pair.second)) sum += count;
  return sum;
}

}  // namespace

TEST_CASE("closures join only ancestors and descendants in an elimination tree",
          "[pose_graph][session]") {
  std::mt19937 generator(3);
  const auto random_below = [&](RobotId count) {
    return std::uniform_int_distribution<RobotId>(0, static_cast<RobotId>(count - 1))(generator);
  };
  for (RobotId trial = 0; trial < 50; ++trial) {
    const auto count = static_cast<RobotId>(2 + trial % 20);
    const std::set<RobotId> robots = first_robots(count);
    PairClosures closures;
    const auto add = [&](RobotId a, RobotId b) {
      if (a != b) closures[{std::min(a, b), std::max(a, b)}] = 1U + random_below(30);
    };
    for (const RobotId robot : robots) {
      if (robot > 0) add(random_below(robot), robot);
      add(random_below(count), robot);
    }
    const RobotTree tree = elimination_tree(robots, closures);
    // A root from which no closure joins two branches: there is one, the robot eliminated last.
    CHECK(std::ranges::any_of(robots, [&](RobotId root) {
      const auto below = parents_below(root, tree);
      const Parents parents(below.begin(), below.end());
      return parents.size() + 1 == robots.size() &&
             std::ranges::all_of(closures, [&](const auto& entry) {
               const auto& [a, b] = entry.first;
               return is_above(a, b, parents) || is_above(b, a, parents);
             });
    }));
  }
}

TEST_CASE("closures over an edge of the tree do not grow with a ring of robots",
          "[pose_graph][session]") {
  for (const RobotId count : std::vector<RobotId>{10, 30, 64}) {
    const std::set<RobotId> robots = first_robots(count);
    const PairClosures closures = ring_of(count);
    const RobotTree tree = choose_tree(robots, closures, links_among(robots));
    const Parents parents = parents_of(robots, tree);
    REQUIRE(parents.size() + 1 == robots.size());
    std::uint32_t most = 0;
    for (const RobotId robot : robots)
      if (parents.contains(robot)) most = std::max(most, closures_over(robot, parents, closures));
    CHECK(most <= 240);  // those of ten pairs, whatever the ring
  }
}

TEST_CASE("the tree keeps to links if detours cost more than closures", "[pose_graph][session]") {
  // Robots in a row with links only to the next: closures also join every second robot.
  const std::set<RobotId> robots = first_robots(8);
  PairClosures closures;
  TeamLinks links;
  for (const RobotId robot : robots) {
    std::set<RobotId> beside;
    const auto next = static_cast<RobotId>(robot + 1);
    if (robot > 0) beside.insert(static_cast<RobotId>(robot - 1));
    if (robot < 7) beside.insert(next);
    (void)links.report(robot, beside);
    if (robot < 7) closures[{robot, next}] = 5;
    if (robot < 6) closures[{robot, static_cast<RobotId>(robot + 2)}] = 5;
  }
  for (const auto& [robot, parent] : parents_of(robots, choose_tree(robots, closures, links)))
    CHECK(links.linked(robot, parent));
}

TEST_CASE("the root is in the middle of the tree", "[pose_graph][session]") {
  const auto row = [](RobotId count) {
    RobotTree tree;
    for (RobotId robot = 1; robot < count; ++robot) {
      const auto before = static_cast<RobotId>(robot - 1);
      tree[robot].push_back(before);
      tree[before].push_back(robot);
    }
    return centre_of(first_robots(count), tree);
  };
  using Centre = std::pair<RobotId, RobotId>;
  CHECK(row(1) == Centre(0, 0));
  CHECK(row(2) == Centre(0, 1));
  CHECK(row(5) == Centre(2, 2));
  CHECK(row(6) == Centre(2, 3));
}

}  // namespace km
