#include "modules/session/team_plan.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

TeamStatus status_of(RobotId robot, std::vector<EdgeSetOffer> offers) {
  return {.sender = {robot, 9}, .keyframes = 5, .revision = 5, .offers = std::move(offers)};
}

std::map<RobotId, TeamStatus> by_robot(const std::vector<TeamStatus>& statuses) {
  std::map<RobotId, TeamStatus> map;
  for (const TeamStatus& status : statuses) map[status.sender.robot] = status;
  return map;
}

std::vector<RobotId> order_of(const SessionPlan& plan) {
  std::vector<RobotId> order;
  for (const SessionMember& member : plan.members) order.push_back(member.peer.robot);
  return order;
}

TeamLinks links_of(const std::vector<std::pair<RobotId, RobotId>>& pairs) {
  std::map<RobotId, std::set<RobotId>> received;
  for (const auto& [a, b] : pairs) {
    received[a].insert(b);
    received[b].insert(a);
  }
  TeamLinks links;
  for (const auto& [robot, others] : received) (void)links.report(robot, others);
  return links;
}

std::map<RobotId, RobotId> parents_of(const SessionPlan& plan) {
  std::map<RobotId, RobotId> parents;
  for (const SessionMember& member : plan.members)
    if (member.parent) parents[member.peer.robot] = *member.parent;
  return parents;
}

// Robots of a chain of agreed edges, with the given numbers for each pair.
std::map<RobotId, TeamStatus> chain_of(const std::vector<RobotId>& robots,
                                       const std::vector<std::uint32_t>& edges) {
  std::vector<TeamStatus> statuses;
  for (const RobotId robot : robots) statuses.push_back(status_of(robot, {}));
  for (std::size_t k = 0; k + 1 < robots.size(); ++k) {
    statuses[k].offers.push_back({robots[k + 1], edges[k], {1, k}});
    statuses[k + 1].offers.push_back({robots[k], edges[k], {1, k}});
  }
  return by_robot(statuses);
}

SessionPlan planned(const std::map<RobotId, TeamStatus>& statuses, const TeamLinks& links,
                    RobotId self) {
  SessionPlan plan = plan_session(statuses, self);
  plan_tree(plan, statuses, links);
  return plan;
}

}  // namespace

TEST_CASE("two robots agree on the newest edges that both hold") {
  const TeamStatus a = status_of(1, {{2, 9, {4, 40}}, {2, 8, {3, 30}}, {2, 7, {2, 20}}});
  TeamStatus b = status_of(2, {{1, 8, {3, 30}}, {1, 7, {2, 20}}});
  REQUIRE(agreed_edges(a, b));
  CHECK(agreed_edges(a, b)->id == EdgeSetId{3, 30});
  b.offers.front().id.hash = 31;  // equal version, other closures
  CHECK(agreed_edges(a, b)->id == EdgeSetId{2, 20});
  b.offers.pop_back();
  CHECK_FALSE(agreed_edges(a, b));
}

TEST_CASE("closures_between() counts the closures of the pairs of a session") {
  const TeamStatus a = status_of(1, {{2, 9, {4, 40}}, {2, 7, {3, 30}}, {3, 5, {1, 10}}});
  const TeamStatus b = status_of(2, {{1, 7, {3, 30}}});
  const auto statuses = by_robot({a, b, status_of(3, {})});
  CHECK(closures_between(plan_session(statuses, 1), statuses) == 7);
  CHECK(closures_between(plan_session(statuses, 3), statuses) == 0);
}

TEST_CASE("the plan contains the connected component, best connected robots first") {
  // 3 -10- 8 -2- 5 -7- 3, and separately 20 -4- 21; 30 claims edges to 3 that 3 does not know.
  const auto statuses =
      by_robot({status_of(3, {{8, 10, {1, 1}}, {5, 7, {1, 2}}}),
                status_of(8, {{3, 10, {1, 1}}, {5, 2, {1, 3}}}),
                status_of(5, {{3, 7, {1, 2}}, {8, 2, {1, 3}}}), status_of(20, {{21, 4, {1, 4}}}),
                status_of(21, {{20, 4, {1, 4}}}), status_of(30, {{3, 99, {1, 5}}})});
  const SessionPlan plan = plan_session(statuses, 5);
  CHECK(order_of(plan) == std::vector<RobotId>{3, 8, 5});
  CHECK(coordinator_of(plan) == 3);
  CHECK(plan.pairs == std::vector<SessionPair>{{3, 5, {1, 2}}, {3, 8, {1, 1}}, {5, 8, {1, 3}}});
  for (const RobotId member : {RobotId{3}, RobotId{8}})
    CHECK(plan_session(statuses, member) == plan);
  CHECK(order_of(plan_session(statuses, 21)) == std::vector<RobotId>{20, 21});
  CHECK(order_of(plan_session(statuses, 30)) == std::vector<RobotId>{30});
  CHECK_THROWS_AS(plan_session(statuses, 4), std::invalid_argument);
  CHECK(order_of(plan_session(chain_of({1, 2, 3, 4}, {3, 4, 2}), 1)) ==
        std::vector<RobotId>{2, 3, 1, 4});
}

TEST_CASE("ties join the members of each datum to the lowest one") {
  auto statuses = chain_of({4, 2, 7, 5, 9}, {3, 3, 3, 3});
  for (const RobotId robot : {RobotId{4}, RobotId{7}, RobotId{9}}) statuses[robot].datum = 77;
  statuses[5].datum = 78;
  const SessionPlan plan = plan_session(statuses, 2);
  const auto ends_of = [&plan](RobotId robot) {
    std::vector<ClosureId> ends;
    for (const PoseEdge& tie : datum_ties(plan, robot)) {
      CHECK(tie.T_from_to.matrix() == SE3::Identity().matrix());
      ends.push_back({tie.from, tie.to});
    }
    return ends;
  };
  const ClosureId to_7{{4, 0}, {7, 0}}, to_9{{4, 0}, {9, 0}};
  CHECK(ends_of(4) == std::vector{to_7, to_9});
  CHECK(ends_of(7) == std::vector{to_7});
  CHECK(ends_of(9) == std::vector{to_9});
  for (const RobotId robot : {RobotId{2}, RobotId{5}}) CHECK(ends_of(robot).empty());
  statuses[7].datum = 0;
  const SessionPlan without_7 = plan_session(statuses, 2);
  CHECK_FALSE(same_graph(plan, without_7));
  CHECK(datum_ties(without_7, 7).empty());
}

TEST_CASE("closures and keyframes decide which of two robots in the middle is the root") {
  const TeamLinks links = links_of({{1, 2}, {2, 3}, {3, 4}});
  const auto root_of = [&](const std::vector<std::uint32_t>& edges, std::uint32_t keyframes_of_3) {
    auto statuses = chain_of({1, 2, 3, 4}, edges);
    statuses.at(3).keyframes = statuses.at(2).keyframes + keyframes_of_3;
    const auto parents = parents_of(planned(statuses, links, 1));
    return parents.contains(2) ? 3 : 2;
  };
  CHECK(root_of({3, 5, 4}, 0) == 3);
  CHECK(root_of({4, 5, 3}, 1) == 2);
  CHECK(root_of({3, 5, 3}, 1) == 3);
  CHECK(root_of({3, 5, 3}, 0) == 2);
}

TEST_CASE("the tree follows links with the most agreed edges, its root in the middle") {
  const auto statuses = chain_of({1, 2, 3, 4, 5}, {5, 5, 5, 5});
  using Links = std::vector<std::pair<RobotId, RobotId>>;
  using Parents = std::map<RobotId, RobotId>;
  const Parents line{{1, 2}, {2, 3}, {4, 3}, {5, 4}};
  const auto [links, parents] = GENERATE_COPY(table<Links, Parents>(
      {{{{1, 2}, {2, 3}, {3, 4}, {4, 5}}, line},
       {{{1, 3}, {3, 5}, {5, 2}, {2, 4}}, {{1, 3}, {3, 5}, {2, 5}, {4, 2}}},  // without closures
       {{{1, 5}, {2, 5}, {3, 5}, {4, 5}}, {{1, 5}, {2, 5}, {3, 5}, {4, 5}}},
       {{{1, 2}, {2, 9}, {9, 3}, {3, 4}, {4, 5}}, line}}));  // robot 9 is no member
  CHECK(parents_of(planned(statuses, links_of(links), 1)) == parents);
  CHECK(parents_of(planned(statuses, {}, 1)).size() == 4);  // unknown links
}

TEST_CASE("the link with the fewest edges of a cycle is not in the tree") {
  auto statuses = chain_of({1, 2, 3}, {4, 9});
  statuses[1].offers.push_back({3, 6, {2, 2}});
  statuses[3].offers.push_back({1, 6, {2, 2}});
  const auto plan = planned(statuses, links_of({{1, 2}, {2, 3}, {1, 3}}), 2);
  CHECK(parents_of(plan) == std::map<RobotId, RobotId>{{1, 3}, {2, 3}});
  const auto place = place_in(plan, 3);
  REQUIRE(place);
  CHECK_FALSE(place->parent);
  CHECK(place->children == std::vector<RobotId>{1, 2});
  CHECK(place->members == std::vector<RobotId>{1, 2, 3});
  CHECK(place_in(plan, 1)->parent == RobotId{3});
  CHECK(place_in(plan, 1)->root == 3);
}

TEST_CASE("parents that do not form a tree give no place") {
  SessionPlan plan = planned(chain_of({1, 2, 3}, {1, 1}), links_of({{1, 2}, {2, 3}}), 1);
  REQUIRE(place_in(plan, 1));
  CHECK_FALSE(place_in(plan, 7));
  const SessionPlan good = plan;
  for (SessionMember& member : plan.members)
    if (!member.parent) member.parent = 1;
  CHECK_FALSE(place_in(plan, 1));  // a cycle
  plan = good;
  for (SessionMember& member : plan.members) member.parent.reset();
  CHECK_FALSE(place_in(plan, 1));  // three roots
  plan = good;
  plan.members[0].parent = 77;
  CHECK_FALSE(place_in(plan, 1));
  plan = good;
  plan.members.push_back(plan.members.back());
  CHECK_FALSE(place_in(plan, 1));
}

TEST_CASE("plans with different trees and frames can have the same graph") {
  const auto statuses = chain_of({1, 2, 3}, {1, 1});
  const SessionPlan x = planned(statuses, links_of({{1, 2}, {2, 3}}), 1);
  SessionPlan y = planned(statuses, links_of({{1, 3}, {2, 3}}), 1);
  y.frame = {{3, 9}, 1};
  CHECK_FALSE(x == y);
  CHECK(same_graph(x, y));
  CHECK_FALSE(has_lost_member(x, y));
  y.members.front().peer.boot = 10;
  CHECK_FALSE(same_graph(x, y));
  CHECK(has_lost_member(x, y));
}

TEST_CASE("a plan without a robot has nothing new, unless another has changed") {
  const SessionPlan plan = planned(chain_of({1, 2, 3}, {1, 1}), links_of({{1, 2}, {2, 3}}), 1);
  SessionPlan without = planned(chain_of({1, 2}, {1}), links_of({{1, 2}}), 1);
  CHECK(has_nothing_new(plan, without));
  CHECK_FALSE(has_nothing_new(without, plan));
  ++without.members.front().revision;
  CHECK_FALSE(has_nothing_new(plan, without));
}

}  // namespace km
