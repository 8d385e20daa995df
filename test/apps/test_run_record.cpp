#include <catch2/catch.hpp>

#include "apps/robot/run_record.hpp"

namespace km {
namespace {

Closure closure_between(const ClosureId& id) {
  Closure closure;
  closure.from.id = id.from;
  closure.to.id = id.to;
  return closure;
}

}  // namespace

TEST_CASE("what the optimiser rejects is no inlier, until it takes it back", "[robot]") {
  const ClosureId kept{{1, 2}, {2, 3}};
  const ClosureId doubted{{1, 4}, {2, 5}};
  const ClosureId inconsistent{{1, 6}, {2, 7}};
  RunRecord record(1);
  for (const ClosureId& id : {kept, doubted, inconsistent}) {
    record.add(closure_between(id));
    record.add(ClosureOutcome{.id = id, .stage = ClosureStage::kVerified, .reason = {}});
  }
  record.add(InlierSet{1, 2, 1, {kept, doubted}});
  record.add(ClosureVerdicts{{{kept, true}, {doubted, false}}});

  auto outcomes = record.outcomes();
  REQUIRE(outcomes.size() == 3);
  CHECK(outcomes[0].stage == ClosureStage::kInlier);
  CHECK(outcomes[1].stage == ClosureStage::kVerified);
  CHECK(outcomes[1].reason == "rejected by graduated non-convexity");
  CHECK(outcomes[2].reason == "inconsistent with the other closures of the robot pair");
  CHECK(record.inlier_closures().size() == 1);
  CHECK(record.stages_per_peer().at(2).inliers == 1);

  record.add(ClosureVerdicts{{{doubted, true}}});
  outcomes = record.outcomes();
  CHECK(outcomes[1].stage == ClosureStage::kInlier);
  CHECK(outcomes[1].reason.empty());
  CHECK(record.inlier_closures().size() == 2);
}

}  // namespace km
