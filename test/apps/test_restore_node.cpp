#include <catch2/catch.hpp>

#include <string>
#include <vector>

#include "apps/robot/restore_node.hpp"

namespace km {
namespace {

KeyframeId keyframe_of(RobotId robot, KeyframeIndex index) {
  return {.robot = robot, .index = index};
}

Closure closure_of(KeyframeId from, KeyframeId to) {
  Closure closure;
  closure.from.id = from;
  closure.to.id = to;
  return closure;
}

// Whether a place is known depends on the closures found until then.
TEST_CASE("A restored closure follows the last keyframe on which it ends", "[robot][restore]") {
  constexpr RobotId kSelf = 1;
  RestoredRun run;
  run.robot = kSelf;
  for (KeyframeIndex i = 0; i < 4; ++i) {
    run.odometry.push_back({.id = keyframe_of(kSelf, i)});
    run.keyframes.emplace_back().odometry.id = keyframe_of(kSelf, i);
  }
  run.closures = {closure_of(keyframe_of(kSelf, 3), keyframe_of(kSelf, 1)),
                  closure_of(keyframe_of(kSelf, 0), keyframe_of(kSelf, 2)),
                  closure_of(keyframe_of(2, 70), keyframe_of(kSelf, 1)),
                  closure_of(keyframe_of(0, 5), keyframe_of(2, 9))};

  Topic<OdometryState> states;
  Topic<KeyframeOdometry> odometry;
  Topic<Keyframe> keyframes;
  Topic<Closure> own, peers;
  Topic<ClosureOutcome> outcomes;
  Topic<InlierSet> inlier_sets;
  std::string order;
  keyframes.subscribe([&](const auto& k) { order += std::to_string(k->odometry.id.index); });
  own.subscribe([&](const auto& c) { order += c->to.id.index == 1 ? 'a' : 'b'; });
  peers.subscribe([&](const auto& c) { order += c->from.id.robot == 2 ? 'c' : 'd'; });
  RestoreNode node({.states = states,
                    .odometry = odometry,
                    .keyframes = keyframes,
                    .own_closures = own,
                    .peer_closures = peers,
                    .outcomes = outcomes,
                    .inlier_sets = inlier_sets});
  node.set(std::move(run));
  node.start();
  CHECK(order == "0d1c2b3a");
}

}  // namespace
}  // namespace km
