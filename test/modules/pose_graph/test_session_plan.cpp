#include <catch2/catch.hpp>

#include "modules/pose_graph/round_ledger.hpp"
#include "modules/pose_graph/session_plan.hpp"

namespace km {
namespace {

PgoStatus status_of(RobotId robot, std::vector<EdgeSetOffer> offers) {
  return {.sender = {robot, 9},
          .frame = {robot, 9},
          .keyframes = 5,
          .revision = 5,
          .offers = std::move(offers)};
}

std::map<RobotId, PgoStatus> by_robot(const std::vector<PgoStatus>& statuses) {
  std::map<RobotId, PgoStatus> map;
  for (const PgoStatus& status : statuses) map[status.sender.robot] = status;
  return map;
}

std::vector<RobotId> order_of(const SessionPlan& plan) {
  std::vector<RobotId> order;
  for (const SessionMember& member : plan.members) order.push_back(member.peer.robot);
  return order;
}

}  // namespace

TEST_CASE("two robots agree on the newest edges that both hold", "[pose_graph][session]") {
  const PgoStatus a = status_of(1, {{2, 9, {4, 40}}, {2, 8, {3, 30}}, {2, 7, {2, 20}}});
  PgoStatus b = status_of(2, {{1, 8, {3, 30}}, {1, 7, {2, 20}}});
  REQUIRE(agreed_edges(a, b));
  CHECK(agreed_edges(a, b)->id == EdgeSetId{3, 30});
  b.offers.front().id.hash = 31;  // the same version of other closures
  CHECK(agreed_edges(a, b)->id == EdgeSetId{2, 20});
  b.offers.pop_back();
  CHECK_FALSE(agreed_edges(a, b));
}

TEST_CASE("what a session knows are the closures of its pairs and changes inside its robots",
          "[pose_graph][session]") {
  PgoStatus a = status_of(1, {{2, 9, {4, 40}}, {2, 7, {3, 30}}, {3, 5, {1, 10}}});
  PgoStatus b = status_of(2, {{1, 7, {3, 30}}});
  const PgoStatus c = status_of(3, {});
  CHECK(closures_known(plan_session(by_robot({a, b, c}), 1), by_robot({a, b, c})) == 7);
  b.revision = b.keyframes + 4;
  CHECK(closures_known(plan_session(by_robot({a, b, c}), 1), by_robot({a, b, c})) == 11);
  CHECK(closures_known(plan_session(by_robot({a, b, c}), 3), by_robot({a, b, c})) == 0);
  b.revision = 0;  // no robot says so, but a message can
  CHECK(closures_known(plan_session(by_robot({a, b, c}), 1), by_robot({a, b, c})) == 7);
}

TEST_CASE("the plan holds the component, best connected first", "[pose_graph][session]") {
  // 3 -10- 8 -2- 5 -7- 3, and 20 -4- 21 apart; 30 claims edges to 3 that 3 does not know.
  const auto statuses =
      by_robot({status_of(3, {{8, 10, {1, 1}}, {5, 7, {1, 2}}}),
                status_of(8, {{3, 10, {1, 1}}, {5, 2, {1, 3}}}),
                status_of(5, {{3, 7, {1, 2}}, {8, 2, {1, 3}}}), status_of(20, {{21, 4, {1, 4}}}),
                status_of(21, {{20, 4, {1, 4}}}), status_of(30, {{3, 99, {1, 5}}})});
  const SessionPlan plan = plan_session(statuses, 5);
  CHECK(order_of(plan) == std::vector<RobotId>{3, 8, 5});
  CHECK(plan.frame == PgoFrame{3, 9});
  CHECK(coordinator_of(plan) == 3);
  CHECK(plan.pairs == std::vector<SessionPair>{{3, 5, {1, 2}}, {3, 8, {1, 1}}, {5, 8, {1, 3}}});
  for (const RobotId member : {RobotId{3}, RobotId{8}})
    CHECK(plan_session(statuses, member) == plan);
  CHECK(order_of(plan_session(statuses, 21)) == std::vector<RobotId>{20, 21});
  CHECK(order_of(plan_session(statuses, 30)) == std::vector<RobotId>{30});
  CHECK_THROWS_AS(plan_session(statuses, 4), std::invalid_argument);
}

TEST_CASE("the frame of most members stays", "[pose_graph][session]") {
  auto statuses =
      by_robot({status_of(1, {{2, 3, {1, 1}}}), status_of(2, {{1, 3, {1, 1}}, {3, 3, {1, 2}}}),
                status_of(3, {{2, 3, {1, 2}}})});
  statuses[3].frame = statuses[2].frame;
  const SessionPlan plan = plan_session(statuses, 1);
  CHECK(plan.frame == PgoFrame{2, 9});
  CHECK(order_of(plan) == std::vector<RobotId>{2, 3, 1});
  CHECK(coordinator_of(plan) == 1);
}

TEST_CASE("the ledger sums complete rounds, whatever the order", "[pose_graph][session]") {
  RoundLedger ledger({1, 2});
  CHECK_FALSE(ledger.record(1, 1, 10.0, 9.0));
  CHECK_FALSE(ledger.record(1, 2, 8.0, 4.0));
  CHECK_FALSE(ledger.record(7, 1, 1.0, 1.0));  // no member
  CHECK(ledger.record(2, 1, 20.0, 16.0));
  REQUIRE(ledger.last());
  CHECK(ledger.last()->cost == 30.0);
  CHECK(ledger.last()->gradient_norm == 5.0);
  CHECK_FALSE(ledger.relative_decrease());
  CHECK_FALSE(ledger.record(1, 4, 7.0, 1.0));
  CHECK(ledger.record(2, 4, 13.0, 1.0));  // rounds 2 and 3 have been passed over
  CHECK(ledger.last()->round == 4);
  CHECK(ledger.relative_decrease() == Approx((30.0 - 20.0) / 3.0 / 20.0));
  CHECK_FALSE(ledger.record(2, 2, 18.0, 1.0));
}

}  // namespace km
