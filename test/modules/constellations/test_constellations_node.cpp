#include <catch2/catch.hpp>

#include <memory>
#include <random>

#include "modules/constellations/node/constellations_node.hpp"
#include "test/modules/constellations/object_messages.hpp"
#include "test/runtime/dds/dds_fixture.hpp"
#include "test/support/inbox.hpp"

namespace km {
namespace {

struct NodeChannels {
  [[nodiscard]] ConstellationsTopics ends() {
    return {.own_objects = own,
            .peer_objects = peers,
            .closures = closures,
            .restarts = restarts,
            .found = found,
            .outcomes = outcomes};
  }
  Topic<RobotObjects> own, peers;
  Topic<Closure> closures, found;
  Topic<PeerEvent> restarts;
  Topic<ClosureOutcome> outcomes;
  Inbox<Closure> made{found};
  Inbox<ClosureOutcome> reported{outcomes};
};

}  // namespace

TEST_CASE("The started node finds the place, and is then done", "[node]") {
  std::mt19937 rng(2);
  const auto scene = square(24, rng);
  NodeChannels channels;
  ConstellationsNode node(1, channels.ends());
  node.start();
  CHECK(node.is_done());
  channels.own.publish(message_of(1, scene, random_upright(rng), 1.0, 0.1, rng));
  channels.peers.publish(message_of(2, scene, random_upright(rng), -1.0, 0.1, rng));
  CHECK(eventually([&] { return channels.made.messages().size() == 1; }));
  CHECK(eventually([&] { return node.is_done(); }));
  node.stop();
  CHECK(node.error() == nullptr);
}

}  // namespace km
