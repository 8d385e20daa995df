#include <algorithm>
#include <catch2/catch.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "test/modules/relay/relay_network.hpp"

namespace km {
namespace {

std::vector<std::uint32_t> first(std::uint32_t count) {
  std::vector<std::uint32_t> numbers(count);
  for (std::uint32_t i = 0; i < count; ++i) numbers[i] = i;
  return numbers;
}

}  // namespace

TEST_CASE("Robots that all receive each other forward nothing and report no stored messages",
          "[relay]") {
  const bool has_keys = GENERATE(false, true);
  CAPTURE(has_keys);
  Network network(3, has_keys);
  network.link(kA, kB);
  network.link(kA, kC);
  network.link(kB, kC);
  network.run(2.0);
  for (std::uint32_t i = 0; i < 50; ++i) {
    network.send_bag(kA, i);
    network.at(kA).wrote(RelayKind::kClosure, {kB}, i, octets(700), i);
    network.run(kPeriod_s);
  }
  CHECK(network.packets() == 0);
  for (const RobotId robot : {kA, kB, kC}) {
    CHECK(network.at(robot).summary().received.size() == 2);
    CHECK(network.at(robot).summary().holds.empty());
  }
}

TEST_CASE("A robot gets each bag of a robot out of range once and in order", "[relay]") {
  const bool has_keys = GENERATE(false, true);
  CAPTURE(has_keys);
  Network network(3, has_keys);
  network.link(kA, kC);
  for (std::uint32_t i = 0; i < 300; ++i) network.send_bag(kA, i);
  SECTION("at the same time") {}
  SECTION("before") {
    network.run(2.0);
    network.cut(kA, kC);
  }
  network.link(kC, kB);
  network.run(15.0);
  REQUIRE(network.met(kB).size() == 1);
  CHECK(network.met(kB)[0].boot == Network::first_boot(kA));
  CHECK(network.met(kB)[0].name == "r0");
  CHECK(network.read(kB, RelayKind::kBag) == first(300));
  const std::size_t signature = has_keys ? kEndorsementBytes : 0;
  const std::size_t introductions = has_keys ? 2 * 300 : 100;
  CHECK(network.octets_sent() < 300 * (600 + signature) + introductions);
  CHECK(network.at(kB).summary().holds ==
        std::vector<RelayHeld>{{{kA, Network::first_boot(kA)}, 300, 0}});
}

TEST_CASE("A bag that arrives before its robot is announced is stored", "[relay]") {
  Network network(3);
  CHECK(network.at(kC).keep_bag(network.identity(kA), 0, octets(600)) == RelayArrival::kNew);
  CHECK_FALSE(network.at(kC).receives(kA));
  network.link(kA, kC);
  network.link(kB, kC);
  network.run(10.0);
  CHECK(network.read(kB, RelayKind::kBag) == first(1));
}

TEST_CASE("Bags pass along a chain and only one of two robots in between forwards them",
          "[relay]") {
  const bool has_keys = GENERATE(false, true);
  CAPTURE(has_keys);
  Network network(4, has_keys);
  SECTION("a chain of four") {
    network.link(kA, kC);
    network.link(kC, kD);
    network.link(kD, kB);
  }
  SECTION("two between") {
    network.link(kA, kC);
    network.link(kA, kD);
    network.link(kC, kD);
    network.link(kC, kB);
    network.link(kD, kB);
  }
  network.run(20.0);
  const std::size_t before = network.octets_sent();
  for (std::uint32_t i = 0; i < 100; ++i) {
    network.send_bag(kA, i);
    network.run(kPeriod_s);
  }
  network.run(5.0);
  CHECK(network.read(kB, RelayKind::kBag) == first(100));
  const std::size_t forwarded =
      (network.octets_sent() - before) / (600 + (has_keys ? kEndorsementBytes : 0));
  CHECK(forwarded == (network.read(kD, RelayKind::kBag).empty() ? 100 : 200));
}

TEST_CASE("A lost message is sent again and delivered once", "[relay]") {
  const bool has_keys = GENERATE(false, true);
  CAPTURE(has_keys);
  Network network(3, has_keys);
  network.lose(0.3);
  network.link(kA, kC);
  network.link(kC, kB);
  for (std::uint32_t i = 0; i < 100; ++i) network.send_bag(kA, i);
  for (std::uint32_t i = 0; i < 20; ++i)
    network.at(kB).wrote(RelayKind::kClosure, {kA}, i, octets(700), 0.0);
  network.run(400.0);
  std::vector<std::uint32_t> bags = network.read(kB, RelayKind::kBag);
  std::vector<std::uint32_t> closures = network.read(kA, RelayKind::kClosure);
  std::ranges::sort(bags);
  std::ranges::sort(closures);
  CHECK(bags == first(100));
  CHECK(closures == first(20));
}

TEST_CASE("A closure reaches a robot once when it returns into range", "[relay]") {
  const bool has_keys = GENERATE(false, true);
  CAPTURE(has_keys);
  Network network(3, has_keys);
  network.link(kA, kC);
  network.run(1.0);
  network.cut(kA, kC);
  network.link(kB, kC);
  const bool met_before = GENERATE(true, false);
  CAPTURE(met_before);
  if (met_before) network.run(8.0);
  network.at(kB).wrote(RelayKind::kClosure, {kA}, 5, octets(700, 1), 9.0);
  network.at(kB).wrote(RelayKind::kInlierSet, {kA}, 0, octets(20, 2), 9.0);
  network.at(kB).wrote(RelayKind::kInlierSet, {kA}, 0, octets(30, 3), 9.0);
  network.run(10.0);
  SECTION("from a robot that carries it, after its origin has gone") {
    network.cut(kB, kC);
    network.link(kA, kC);
  }
  SECTION("from the origin and a carrier at the same time") {
    network.link(kA, kC);
    network.link(kA, kB);
  }
  network.run(10.0);
  CHECK(network.read(kA, RelayKind::kClosure) == first(1));
  // The newer inlier set replaces the older one.
  CHECK(network.read(kA, RelayKind::kInlierSet) == std::vector<std::uint32_t>{2});
  CHECK(network.read(kC, RelayKind::kClosure).empty());
}

TEST_CASE("The relay sends nothing between robots that soon receive each other directly",
          "[relay]") {
  Network network(3);
  for (std::uint32_t i = 0; i < 20; ++i)
    network.at(kB).wrote(RelayKind::kClosure, {kA}, i, {1}, 0.0);
  network.link(kA, kC);
  network.send_bag(kA, 0);
  network.link(kB, kC);
  network.run(4.0);
  network.link(kA, kB);
  network.run(20.0);
  network.cut(kA, kB);
  network.run(4.0);
  network.link(kA, kB);
  network.run(20.0);
  CHECK(network.packets() == 0);
}

TEST_CASE("A message sent just before a link failed becomes a reliable message", "[relay]") {
  Network network(3);
  network.link(kA, kB);
  network.link(kA, kC);
  network.link(kB, kC);
  network.at(kB).wrote(RelayKind::kClosure, {kA}, 1, octets(700), 0.0);
  network.run(40.0);
  network.at(kB).wrote(RelayKind::kClosure, {kA}, 2, octets(700), 39.0);
  CHECK(network.packets() == 0);
  network.cut(kA, kB);
  network.run(20.0);
  CHECK(network.read(kA, RelayKind::kClosure).size() == 1);
}

TEST_CASE("A message to one incarnation of a robot does not reach the next", "[relay]") {
  const bool has_keys = GENERATE(false, true);
  CAPTURE(has_keys);
  Network network(3, has_keys);
  const std::uint64_t former = Network::first_boot(kA), next = former << 8U;
  network.link(kA, kB);
  network.link(kB, kC);
  network.run(1.0);
  const auto write = [&](std::uint64_t slot, std::uint64_t boot, std::uint8_t what) {
    network.at(kB).wrote(RelayKind::kClosure, {kA, boot}, slot, octets(700, what), 1.0);
  };
  write(1, former, 1);
  write(2, former, 1);
  network.cut(kA, kB);
  SECTION("from its origin") {
    network.start(kA, next);
    network.link(kA, kB);
  }
  SECTION("from a carrier that does not know of the restart") {
    network.run(8.0);
    network.cut(kB, kC);
    network.start(kA, next);
    network.link(kA, kC);
    network.run(8.0);
    CHECK(network.all_read(kA).empty());
    network.link(kA, kB);
  }
  network.run(8.0);
  network.cut(kA, kB);
  write(2, next, 2);
  network.link(kA, kB);
  network.run(8.0);
  const auto& read = network.all_read(kA);
  REQUIRE(read.size() == 1);
  CHECK(read.front()->content.front() == 2);
}

TEST_CASE("A request reaches its addressee and the reply returns", "[relay]") {
  const bool has_keys = GENERATE(false, true);
  CAPTURE(has_keys);
  Network network(4, has_keys);
  network.link(kA, kC);
  network.link(kC, kD);
  network.link(kD, kB);
  network.run(20.0);
  CHECK(network.reachable(kB) == std::vector<RobotId>{kC, kA});
  network.at(kB).call(RelayKind::kRequest, kA, 17, octets(20));
  network.run(kPeriod_s);
  REQUIRE(network.read(kA, RelayKind::kRequest) == std::vector<std::uint32_t>{17});
  CHECK(network.all_read(kA)[0]->origin == TeamPeer{kB, Network::first_boot(kB)});
  network.at(kA).call(RelayKind::kReply, kB, 17, octets(9000));
  network.run(kPeriod_s);
  CHECK(network.read(kB, RelayKind::kReply) == std::vector<std::uint32_t>{17});
  CHECK(network.all_read(kB).back()->origin == TeamPeer{kA, Network::first_boot(kA)});
}

TEST_CASE("A reply that DDS keeps for a known robot is not carried by the relay", "[relay]") {
  Network network(3);
  network.link(kA, kB);
  CHECK(network.at(kA).ways_to(kB) == RelayWays{.direct = true, .relay = false});
  network.cut(kA, kB);
  CHECK(network.at(kA).ways_to(kB) == RelayWays{.direct = true, .relay = true});
  network.at(kA).call(RelayKind::kReply, kB, 17, octets(9000));
  network.link(kA, kB);
  network.run(5.0);
  CHECK(network.packets() == 0);
  network.link(kB, kC);
  network.run(10.0);
  CHECK(network.at(kA).ways_to(kC) == RelayWays{.direct = false, .relay = true});
}

TEST_CASE("A robot that has stored a keyframe replies for its owner after the owner has gone",
          "[relay]") {
  const bool has_keys = GENERATE(false, true);
  CAPTURE(has_keys);
  Network network(3, has_keys);
  network.link(kA, kC);
  network.send_bag(kA, 0);
  network.send_reply(kA, kC, 17);
  network.link(kC, kB);
  network.run(8.0);
  SECTION("the owner is in range and replies itself") {
    network.at(kB).call(RelayKind::kRequest, kA, 17, octets(20));
    network.run(kPeriod_s);
    CHECK(network.read(kA, RelayKind::kRequest).size() == 1);
    CHECK(network.read(kB, RelayKind::kReply).empty());
  }
  SECTION("the owner is gone") {
    network.cut(kA, kC);
    network.at(kB).call(RelayKind::kRequest, kA, 17, octets(20));
    network.run(kPeriod_s);
    CHECK(network.read(kB, RelayKind::kReply) == std::vector<std::uint32_t>{17});
  }
  SECTION("the owner is gone and no robot has the keyframe, so the request is carried once") {
    network.cut(kA, kC);
    for (int i = 0; i < 3; ++i) network.at(kB).call(RelayKind::kRequest, kA, 18, octets(20));
    network.run(kPeriod_s);
    CHECK(network.read(kB, RelayKind::kReply).empty());
    network.cut(kB, kC);
    network.link(kA, kC);
    network.run(kPeriod_s);
    REQUIRE(network.read(kA, RelayKind::kRequest) == std::vector<std::uint32_t>{18});
    network.at(kA).call(RelayKind::kReply, kB, 18, octets(9000));
    network.run(kPeriod_s);
    network.cut(kA, kC);
    network.link(kB, kC);
    network.run(kPeriod_s);
    CHECK(network.read(kB, RelayKind::kReply) == std::vector<std::uint32_t>{18});
  }
}

TEST_CASE("A new incarnation of a robot out of range replaces the former", "[relay]") {
  const bool has_keys = GENERATE(false, true);
  CAPTURE(has_keys);
  Network network(4, has_keys);
  network.link(kA, kC);
  network.link(kC, kB);
  network.link(kB, kD);
  for (std::uint32_t i = 0; i < 10; ++i) network.send_bag(kA, i);
  network.run(20.0);
  REQUIRE(network.read(kD, RelayKind::kBag) == first(10));
  const std::uint64_t other_incarnation = std::uint64_t{99} << 32U;
  SECTION("its bags replace the former ones") {
    network.start(kA, other_incarnation);
    network.send_bag(kA, 0);
    network.run(20.0);
    for (const RobotId robot : {kB, kD}) {
      REQUIRE(network.met(robot).back().boot == other_incarnation);
      CHECK(network.read(robot, RelayKind::kBag).size() == 11);
      CHECK(network.at(robot).origin(kA)->boot == other_incarnation);
    }
  }
  SECTION("it stays, although one robot has missed the restart") {
    network.cut(kB, kD);
    network.start(kA, other_incarnation);
    network.send_bag(kA, 0);
    network.run(20.0);
    CHECK(network.at(kD).origin(kA)->boot == Network::first_boot(kA));
    network.link(kB, kD);
    network.run(20.0);
    CHECK(network.at(kB).origin(kA)->boot == other_incarnation);
    CHECK(network.at(kD).origin(kA)->boot == other_incarnation);
  }
  SECTION("a resumed process keeps its bags") {
    network.start(kA, Network::first_boot(kA) + 1);
    for (std::uint32_t i = 0; i < 12; ++i) network.send_bag(kA, i);
    network.run(20.0);
    CHECK(network.read(kD, RelayKind::kBag) == first(12));
  }
}

TEST_CASE("A neighbour cannot change the state of this robot or of one received directly",
          "[relay]") {
  RelayStore store({kB, 2});
  store.connected({.robot = kC, .name = "c", .boot = 3});
  const auto receive = [&](RobotId from, RelayMessage message) {
    return store.receive({from, std::make_shared<const RelayMessage>(std::move(message))});
  };
  const auto introduction = [](RobotId robot, std::uint64_t boot) {
    return RelayMessage{
        .kind = RelayKind::kIntroduction, .origin = {robot, boot}, .content = {'r'}};
  };
  CHECK(receive(kC, introduction(kB, 9)) == RelayArrival::kRefused);
  CHECK(receive(kC, introduction(kC, 9)) == RelayArrival::kRepeated);
  CHECK(store.origin(kC)->boot == 3);
  CHECK(receive(kD, introduction(kA, 1)) == RelayArrival::kRefused);  // The neighbour is not
                                                                      // received directly.
  const RelayMessage bag{
      .kind = RelayKind::kBag, .origin = {kA, 1}, .number = 0, .content = octets(9)};
  CHECK(receive(kC, bag) == RelayArrival::kRefused);  // The origin is unknown.
  CHECK(receive(kC, introduction(kA, 1)) == RelayArrival::kNew);
  CHECK(receive(kC, bag) == RelayArrival::kNew);
  CHECK(receive(kC, bag) == RelayArrival::kRepeated);
  store.connected({.robot = kD, .name = "d", .boot = 4});
  CHECK(receive(kD, introduction(kA, std::uint64_t{7} << 32U)) == RelayArrival::kRefused);
  store.update(kD, {.received = {kA}}, 0.0);
  CHECK(receive(kD, introduction(kA, std::uint64_t{7} << 32U)) == RelayArrival::kNew);
  store.connected({.robot = kA, .name = "a", .boot = std::uint64_t{7} << 32U});
  RelayMessage of_connected = bag;
  of_connected.origin.boot = std::uint64_t{7} << 32U;
  CHECK(receive(kC, of_connected) == RelayArrival::kRepeated);
}

TEST_CASE("Robots that a neighbour invents cannot exceed the common storage", "[relay]") {
  RelayStore store({kB, 2});
  store.connected({.robot = kC, .name = "c", .boot = 3});
  constexpr std::size_t kSize = 1U << 20U;
  std::size_t taken = 0;
  for (RobotId robot = 10; robot < 60; ++robot) {
    RelayMessage message{.kind = RelayKind::kIntroduction, .origin = {robot, 1}, .content = {'r'}};
    REQUIRE(store.receive({kC, std::make_shared<const RelayMessage>(message)}) ==
            RelayArrival::kNew);
    message.kind = RelayKind::kBag;
    message.content = octets(kSize);
    for (; message.number < 7; ++message.number)
      if (store.receive({kC, std::make_shared<const RelayMessage>(message)}) == RelayArrival::kNew)
        taken += kSize;
    (void)store.take_output();
  }
  CHECK(taken > RelayStore::kMaxFarBytes - 2 * kSize);
  CHECK(taken < RelayStore::kMaxFarBytes);
  CHECK(store.keep_bag({.robot = kA, .name = "a", .boot = 1}, 0, octets(kSize)) ==
        RelayArrival::kNew);
  store.connected({.robot = kA, .name = "a", .boot = 1});
  store.lost(kA, 0.0);
  CHECK(store.summary().holds.front().bags == 1);
}

TEST_CASE("A full store refuses the newest messages and counts them", "[relay]") {
  Network network(2);
  network.link(kA, kC - 1);
  RelayStore& store = network.at(kB);
  constexpr std::size_t kSize = 100'000;
  const auto fit = static_cast<std::uint32_t>(RelayStore::kMaxBagBytes / (kSize + 96));
  for (std::uint32_t i = 0; i < fit + 5; ++i)
    CHECK(store.keep_bag(network.identity(kA), i, octets(kSize)) ==
          (i < fit ? RelayArrival::kNew : RelayArrival::kNoRoom));
  CHECK(store.given_up() == 5);
  store.lost(kA, 0.0);
  CHECK(store.summary().holds == std::vector<RelayHeld>{{{kA, Network::first_boot(kA)}, fit, 0}});
}

}  // namespace km
