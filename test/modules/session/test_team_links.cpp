#include "modules/core/data/team_links.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

void link(TeamLinks& links, const std::vector<std::pair<RobotId, RobotId>>& pairs) {
  std::map<RobotId, std::set<RobotId>> received;
  for (const auto& [a, b] : pairs) {
    received[a].insert(b);
    received[b].insert(a);
  }
  for (const auto& [robot, others] : received) (void)links.report(robot, others);
}

}  // namespace

TEST_CASE("a link counts if both of its robots report it") {
  TeamLinks links;
  CHECK(links.report(1, {2}));
  CHECK_FALSE(links.report(1, {2}));
  CHECK(links.receives(1, 2));
  CHECK_FALSE(links.linked(1, 2));
  CHECK(links.component(1) == std::set<RobotId>{1});
  CHECK(links.report(2, {1, 7}));
  CHECK(links.linked(2, 1));
  CHECK(links.neighbours(2) == std::vector<RobotId>{1});
  links.forget(1);
  CHECK_FALSE(links.linked(1, 2));
}

TEST_CASE("a team is the connected component of links, with shortest paths") {
  TeamLinks links;
  // A ring of five, a tail at 3, and two separate robots.
  link(links, {{1, 2}, {2, 3}, {3, 4}, {4, 5}, {1, 5}, {3, 9}, {20, 21}});
  CHECK(links.component(9) == std::set<RobotId>{1, 2, 3, 4, 5, 9});
  CHECK(links.component(21) == std::set<RobotId>{20, 21});
  CHECK(links.distances(9).at(5) == 3);
  CHECK(links.distances(1).at(9) == 3);
  CHECK(links.distances(4).at(1) == 2);
  CHECK_FALSE(links.distances(1).contains(20));
}

}  // namespace km
