#include <catch2/catch.hpp>

#include <memory>
#include <vector>

#include "modules/surface_ties/node/surface_ties_node.hpp"
#include "test/modules/surface_ties/chunks.hpp"
#include "test/support/inbox.hpp"

namespace km {

TEST_CASE("The node publishes a tie of two robots' chunks as a closure with its outcome",
          "[node]") {
  constexpr RobotId kSelf = 1, kOther = 2;
  Topic<MeshChunk> own_chunks, peer_chunks;
  Topic<MeshPoses> own_poses, peer_poses;
  Topic<Closure> closures, ties;
  Topic<OptimizerProgress> progress;
  Topic<PeerEvent> restarts;
  Topic<ClosureOutcome> outcomes;
  Inbox<Closure> made(ties);
  Inbox<ClosureOutcome> reported(outcomes);
  SurfaceTiesNode node(kSelf, {.own_chunks = own_chunks,
                               .peer_chunks = peer_chunks,
                               .own_poses = own_poses,
                               .peer_poses = peer_poses,
                               .closures = closures,
                               .progress = progress,
                               .restarts = restarts,
                               .ties = ties,
                               .outcomes = outcomes});
  const SE3 T_error = make_pose(so3_exp({0.01, 0.0, 0.0}), {0.03, 0.02, -0.03});
  for (const MeshChunk& chunk : room_chunks(kSelf, 12, SE3::Identity()))
    node.step(std::make_shared<const MeshChunk>(chunk), 0.0);
  for (const MeshChunk& chunk : room_chunks(kOther, 35, T_error))
    node.step(std::make_shared<const MeshChunk>(chunk), 0.0);
  const auto run = [&] {
    for (double now_s = 100.0; now_s < 1e6; now_s *= 2.0) node.step(SurfaceTiesNode::Tick(), now_s);
  };
  OptimizerProgress state;
  state.members = {kSelf, kOther};
  SECTION("two robots in one frame") {
    node.step(std::make_shared<const OptimizerProgress>(state), 0.0);
    run();
    REQUIRE(made.messages().size() == 1);
    CHECK(made.messages()[0].id() == closure_id({kSelf, 12}, {kOther, 35}));
    REQUIRE(reported.messages().size() == 1);
    CHECK(reported.messages()[0].stage == ClosureStage::kVerified);
  }
  SECTION("a tentative pose") {
    state.tentative = {kOther};
    node.step(std::make_shared<const OptimizerProgress>(state), 0.0);
    run();
    CHECK(made.messages().empty());
  }
}

}  // namespace km
