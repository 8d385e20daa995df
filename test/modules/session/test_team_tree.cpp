#include "modules/session/team_tree.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

std::set<RobotId> first_robots(RobotId count) {
  std::set<RobotId> robots;
  for (RobotId robot = 0; robot < count; ++robot) robots.insert(robot);
  return robots;
}

}  // namespace

TEST_CASE("the tree keeps to links that connect the robots") {
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
  for (const auto& [robot, parent] : parents_below(4, choose_tree(robots, closures, links)))
    CHECK(links.linked(robot, parent));
}

TEST_CASE("the root is in the middle of the tree") {
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
