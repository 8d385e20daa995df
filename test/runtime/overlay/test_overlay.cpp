#include "test/runtime/overlay/overlay_network.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

std::vector<std::uint32_t> first(std::uint32_t count) {
  std::vector<std::uint32_t> numbers(count);
  for (std::uint32_t i = 0; i < count; ++i) numbers[i] = i;
  return numbers;
}

}  // namespace

TEST_CASE("Robots that all receive each other forward nothing and report no stored messages") {
  const bool has_keys = GENERATE(false, true);
  CAPTURE(has_keys);
  Network network(3, has_keys);
  network.link(kA, kB);
  network.link(kA, kC);
  network.link(kB, kC);
  network.run(2.0);
  for (std::uint32_t i = 0; i < 50; ++i) {
    network.send_bag(kA, i);
    network.at(kA).wrote(OverlayStream::kClosure, {kB}, i, octets(700), i);
    network.run(kPeriod_s);
  }
  CHECK(network.packets() == 0);
  for (const RobotId robot : {kA, kB, kC}) {
    CHECK(network.at(robot).robots().own_links().size() == 2);
    CHECK(network.at(robot).summary().holds.empty());
  }
}

TEST_CASE("Bags pass along a chain and only one of two robots in between forwards them") {
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
  CHECK(network.read(kB, OverlayStream::kBag) == first(100));
  const std::size_t forwarded =
      (network.octets_sent() - before) / (600 + (has_keys ? kEndorsementBytes : 0));
  CHECK(forwarded == (network.read(kD, OverlayStream::kBag).empty() ? 100 : 200));
}

TEST_CASE("A lost message is sent again and delivered once") {
  const bool has_keys = GENERATE(false, true);
  CAPTURE(has_keys);
  Network network(3, has_keys);
  network.lose(0.3);
  network.link(kA, kC);
  network.link(kC, kB);
  for (std::uint32_t i = 0; i < 100; ++i) network.send_bag(kA, i);
  for (std::uint32_t i = 0; i < 20; ++i)
    network.at(kB).wrote(OverlayStream::kClosure, {kA}, i, octets(700), 0.0);
  network.run(400.0);
  std::vector<std::uint32_t> bags = network.read(kB, OverlayStream::kBag);
  std::vector<std::uint32_t> closures = network.read(kA, OverlayStream::kClosure);
  std::ranges::sort(bags);
  std::ranges::sort(closures);
  CHECK(bags == first(100));
  CHECK(closures == first(20));
}

TEST_CASE("A closure reaches a robot once when it returns into range") {
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
  network.at(kB).wrote(OverlayStream::kClosure, {kA}, 5, octets(700, 1), 9.0);
  network.at(kB).wrote(OverlayStream::kInlierSet, {kA}, 0, octets(20, 2), 9.0);
  network.at(kB).wrote(OverlayStream::kInlierSet, {kA}, 0, octets(30, 3), 9.0);
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
  CHECK(network.read(kA, OverlayStream::kClosure) == first(1));
  // The newer inlier set replaces the older one.
  CHECK(network.read(kA, OverlayStream::kInlierSet) == std::vector<std::uint32_t>{2});
  CHECK(network.read(kC, OverlayStream::kClosure).empty());
}

TEST_CASE("The overlay forwards no events between robots that soon receive each other directly") {
  Network network(3);
  for (std::uint32_t i = 0; i < 20; ++i)
    network.at(kB).wrote(OverlayStream::kClosure, {kA}, i, {1}, 0.0);
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
  for (const RobotId robot : {kA, kB, kC}) CHECK(network.all_read(robot).empty());
}

TEST_CASE("A message sent just before a link failed becomes a reliable message") {
  Network network(3);
  network.link(kA, kB);
  network.link(kA, kC);
  network.link(kB, kC);
  network.at(kB).wrote(OverlayStream::kClosure, {kA}, 1, octets(700), 0.0);
  network.run(40.0);
  network.at(kB).wrote(OverlayStream::kClosure, {kA}, 2, octets(700), 39.0);
  CHECK(network.packets() == 0);
  network.cut(kA, kB);
  network.run(20.0);
  CHECK(network.read(kA, OverlayStream::kClosure).size() == 1);
}

TEST_CASE("A message to one incarnation of a robot does not reach the next") {
  const bool has_keys = GENERATE(false, true);
  CAPTURE(has_keys);
  Network network(3, has_keys);
  const std::uint64_t former = Network::first_boot(kA), next = former << 8U;
  network.link(kA, kB);
  network.link(kB, kC);
  network.run(1.0);
  const auto write = [&](std::uint64_t slot, std::uint64_t boot, std::uint8_t what) {
    network.at(kB).wrote(OverlayStream::kClosure, {kA, boot}, slot, octets(700, what), 1.0);
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

TEST_CASE("A reply that DDS keeps for a known robot is not carried by the overlay") {
  Network network(3);
  network.link(kA, kB);
  CHECK(network.at(kA).ways_to(kB) == OverlayWays{.direct = true, .relay = false});
  network.cut(kA, kB);
  CHECK(network.at(kA).ways_to(kB) == OverlayWays{.direct = true, .relay = true});
  CHECK_FALSE(network.at(kA).call(OverlayStream::kReply, kB, 17, octets(9000)));
  network.link(kA, kB);
  network.run(5.0);
  CHECK(network.packets() == 0);
  network.link(kB, kC);
  network.run(10.0);
  CHECK(network.at(kA).ways_to(kC) == OverlayWays{.direct = false, .relay = true});
}

TEST_CASE("A robot that has stored a keyframe replies for its owner after the owner has gone") {
  const bool has_keys = GENERATE(false, true);
  CAPTURE(has_keys);
  Network network(3, has_keys);
  network.link(kA, kC);
  network.send_bag(kA, 0);
  network.send_reply(kA, kC, 17);
  network.link(kC, kB);
  network.run(8.0);
  SECTION("the owner is in range and replies itself") {
    (void)network.at(kB).call(OverlayStream::kRequest, kA, 17, octets(20));
    network.run(kPeriod_s);
    CHECK(network.read(kA, OverlayStream::kRequest).size() == 1);
    CHECK(network.read(kB, OverlayStream::kReply).empty());
  }
  SECTION("the owner is gone") {
    network.cut(kA, kC);
    (void)network.at(kB).call(OverlayStream::kRequest, kA, 17, octets(20));
    network.run(kPeriod_s);
    CHECK(network.read(kB, OverlayStream::kReply) == std::vector<std::uint32_t>{17});
  }
  SECTION("the owner is gone and no robot has the keyframe, so the request is carried once") {
    network.cut(kA, kC);
    for (int i = 0; i < 3; ++i)
      (void)network.at(kB).call(OverlayStream::kRequest, kA, 18, octets(20));
    network.run(kPeriod_s);
    CHECK(network.read(kB, OverlayStream::kReply).empty());
    network.cut(kB, kC);
    network.link(kA, kC);
    network.run(kPeriod_s);
    REQUIRE(network.read(kA, OverlayStream::kRequest) == std::vector<std::uint32_t>{18});
    (void)network.at(kA).call(OverlayStream::kReply, kB, 18, octets(9000));
    network.run(kPeriod_s);
    network.cut(kA, kC);
    network.link(kB, kC);
    network.run(kPeriod_s);
    CHECK(network.read(kB, OverlayStream::kReply) == std::vector<std::uint32_t>{18});
  }
}

TEST_CASE("A new incarnation of a robot out of range replaces the former") {
  const bool has_keys = GENERATE(false, true);
  CAPTURE(has_keys);
  Network network(4, has_keys);
  network.link(kA, kC);
  network.link(kC, kB);
  network.link(kB, kD);
  for (std::uint32_t i = 0; i < 10; ++i) network.send_bag(kA, i);
  network.run(20.0);
  REQUIRE(network.read(kD, OverlayStream::kBag) == first(10));
  const std::uint64_t other_incarnation = std::uint64_t{99} << 32U;
  SECTION("its bags replace the former ones") {
    network.start(kA, other_incarnation);
    network.send_bag(kA, 0);
    network.run(20.0);
    for (const RobotId robot : {kB, kD}) {
      REQUIRE(network.met(robot).back().boot == other_incarnation);
      CHECK(network.read(robot, OverlayStream::kBag).size() == 11);
      CHECK(network.at(robot).robots().process(kA)->boot == other_incarnation);
    }
  }
  SECTION("it stays, although one robot has missed the restart") {
    network.cut(kB, kD);
    network.start(kA, other_incarnation);
    network.send_bag(kA, 0);
    network.run(20.0);
    CHECK(network.at(kD).robots().process(kA)->boot == Network::first_boot(kA));
    network.link(kB, kD);
    network.run(20.0);
    CHECK(network.at(kB).robots().process(kA)->boot == other_incarnation);
    CHECK(network.at(kD).robots().process(kA)->boot == other_incarnation);
  }
  SECTION("a resumed process keeps its bags") {
    network.start(kA, Network::first_boot(kA) + 1);
    for (std::uint32_t i = 0; i < 12; ++i) network.send_bag(kA, i);
    network.run(20.0);
    CHECK(network.read(kD, OverlayStream::kBag) == first(12));
  }
}

TEST_CASE("A neighbour cannot change the state of this robot or of one received directly") {
  Overlay overlay({kB, 2});
  overlay.connected({.robot = kC, .name = "c", .boot = 3}, 0.0);
  const auto receive = [&](RobotId from, OverlayMessage message) {
    const std::uint64_t boot = from == kC ? 3 : 4;
    return overlay.receive({.robot = from, .name = "r", .boot = boot},
                           std::make_shared<const OverlayMessage>(std::move(message)), 0.0);
  };
  const auto introduction = [](RobotId robot, std::uint64_t boot) {
    return OverlayMessage{
        .stream = OverlayStream::kIntroduction, .origin = {robot, boot}, .content = {'r'}};
  };
  CHECK(receive(kC, introduction(kB, 9)) == OverlayArrival::kRefused);
  CHECK(receive(kC, introduction(kC, 9)) == OverlayArrival::kRepeated);
  CHECK(overlay.robots().process(kC)->boot == 3);
  const OverlayMessage bag{
      .stream = OverlayStream::kBag, .origin = {kA, 1}, .number = 0, .content = octets(9)};
  CHECK(receive(kC, bag) == OverlayArrival::kRefused);  // The origin is unknown.
  CHECK(receive(kC, introduction(kA, 1)) == OverlayArrival::kNew);
  CHECK(receive(kC, bag) == OverlayArrival::kNew);
  CHECK(receive(kC, bag) == OverlayArrival::kRepeated);
  overlay.connected({.robot = kD, .name = "d", .boot = 4}, 0.0);
  constexpr std::uint64_t kNext = std::uint64_t{7} << 32U;
  CHECK(receive(kD, introduction(kA, kNext)) == OverlayArrival::kRefused);
  CHECK(receive(kD, {.stream = OverlayStream::kLinks,
                     .origin = {kD, 4},
                     .content = encode_links({{kA, kNext}, {kB, 2}})}) == OverlayArrival::kNew);
  CHECK(receive(kD, introduction(kA, kNext)) == OverlayArrival::kNew);
  overlay.connected({.robot = kA, .name = "a", .boot = kNext}, 0.0);
  OverlayMessage of_connected = bag;
  of_connected.origin.boot = kNext;
  CHECK(receive(kC, of_connected) == OverlayArrival::kRepeated);
}

TEST_CASE("Robots that a neighbour invents cannot exceed the common storage") {
  Overlay overlay({kB, 2});
  const RobotIdentity neighbour{.robot = kC, .name = "c", .boot = 3};
  overlay.connected(neighbour, 0.0);
  const auto receive = [&](const OverlayMessage& message) {
    return overlay.receive(neighbour, std::make_shared<const OverlayMessage>(message), 0.0);
  };
  constexpr std::size_t kSize = 1U << 20U;
  for (RobotId robot = 10; robot < 60; ++robot) {
    OverlayMessage message{
        .stream = OverlayStream::kIntroduction, .origin = {robot, 1}, .content = {'r'}};
    REQUIRE(receive(message) == OverlayArrival::kNew);
    message.stream = OverlayStream::kBag;
    message.content = octets(kSize);
    for (; message.number < 7; ++message.number) (void)receive(message);
    (void)overlay.take_output();
  }
  CHECK(overlay.memory_bytes() > MessageStore::kMaxFarBytes - 2 * kSize);
  CHECK(overlay.memory_bytes() < MessageStore::kMaxFarBytes);
  CHECK(overlay.keep_bag({.robot = kA, .name = "a", .boot = 1}, 0, octets(kSize)) ==
        OverlayArrival::kNew);
  overlay.connected({.robot = kA, .name = "a", .boot = 1}, 0.0);
  overlay.lost(kA, 0.0);
  CHECK(overlay.summary().holds.front().bags == 1);
}

TEST_CASE("A new robot takes the place of the one that has been lost for longest") {
  Overlay overlay({kA, 1});
  const auto connect = [&](RobotId robot, double now_s) {
    overlay.connected({.robot = robot, .name = name_of(robot), .boot = 1}, now_s);
    return overlay.robots().receives(robot);
  };
  for (RobotId robot = 1; robot <= kMaxTeam; ++robot) REQUIRE(connect(robot, 0.0));
  CHECK_FALSE(connect(kMaxTeam + 1, 1.0));
  overlay.lost(20, 2.0);
  overlay.lost(10, 3.0);
  CHECK(connect(kMaxTeam + 1, 4.0));
  CHECK_FALSE(overlay.robots().process(20));
  CHECK(connect(10, 5.0));
  CHECK_FALSE(connect(20, 6.0));
}

TEST_CASE("A full store discards the oldest messages, and a late robot gets the others") {
  Network network(3);
  network.link(kA, kB);
  constexpr std::size_t kSize = 100'000;
  const auto fit = static_cast<std::uint32_t>(MessageStore::kMaxBagBytes / (kSize + 96));
  for (std::uint32_t i = 0; i < fit + 5; ++i)
    CHECK(network.at(kB).keep_bag(network.identity(kA), i, octets(kSize)) == OverlayArrival::kNew);
  CHECK(network.at(kB).keep_bag(network.identity(kA), 2, octets(kSize)) ==
        OverlayArrival::kRepeated);
  CHECK(network.at(kB).memory_bytes() <= MessageStore::kMaxBagBytes);
  network.link(kB, kC);
  network.run(200.0);
  std::vector<std::uint32_t> bags = network.read(kC, OverlayStream::kBag);
  REQUIRE(bags.size() == fit);
  CHECK(bags.front() == 5);
  CHECK(std::ranges::is_sorted(bags));
}

TEST_CASE("Closures of a day between five robots in a line arrive once, in constant memory") {
  constexpr double kInterval_s = 40.0;
  constexpr RobotId kRobots = 5;
  constexpr std::uint32_t kCount = 86400 / 40;
  Network network(kRobots);
  for (RobotId robot = 0; robot + 1 < kRobots; ++robot)
    network.link(robot, static_cast<RobotId>(robot + 1));
  network.run(20.0);
  std::set<std::pair<RobotId, std::uint32_t>> closures;
  std::size_t arrived = 0;
  std::array<std::size_t, 2> bytes{};  // maxima of the first 18 hours and of the rest
  for (std::uint32_t i = 0; i < kCount + 2; ++i) {
    for (RobotId robot = 0; robot < kRobots && i < kCount; ++robot) {
      const TeamPeer to{static_cast<RobotId>((robot + 2 + i % 2) % kRobots)};  // out of range
      Overlay& overlay = network.at(robot);
      overlay.wrote(OverlayStream::kClosure, to, i, octets(4000), network.now_s());
      overlay.wrote(OverlayStream::kInlierSet, to, 0, octets(400), network.now_s());
      for (const std::uint32_t k : {0U, 1U}) network.send_bag(robot, 2 * i + k, 3000);
    }
    network.run(kInterval_s, kInterval_s);
    for (RobotId robot = 0; robot < kRobots; ++robot)
      for (const OverlayMessagePtr& message : std::exchange(network.all_read(robot), {})) {
        if (message->stream != OverlayStream::kClosure) continue;
        ++arrived;
        closures.emplace(message->origin.robot, message->number);
      }
    std::size_t& most = bytes[4 * i < 3 * kCount ? 0 : 1];
    for (RobotId robot = 0; robot < kRobots; ++robot)
      most = std::max(most, network.at(robot).memory_bytes());
  }
  CHECK(arrived == kCount * kRobots);
  CHECK(closures.size() == arrived);
  CHECK(bytes[1] <= bytes[0] + bytes[0] / 50);
  for (RobotId robot = 0; robot < kRobots; ++robot) CHECK(network.at(robot).given_up() == 0);
}

TEST_CASE("Requests to a robot that never returns leave room for requests to others") {
  Network network(4);
  for (const RobotId robot : {kA, kB, kD}) network.link(robot, kC);
  network.run(8.0);
  for (const RobotId robot : {kA, kD}) network.cut(robot, kC);
  constexpr std::size_t kSize = 1000;
  for (std::uint32_t i = 0; i < MessageStore::kMaxCarriedBytes / kSize; ++i)
    (void)network.at(kB).call(OverlayStream::kRequest, kA, i, octets(kSize));
  (void)network.at(kB).call(OverlayStream::kRequest, kD, 17, octets(20));
  network.run(8.0);
  network.link(kC, kD);
  network.run(1.0);
  CHECK(network.read(kD, OverlayStream::kRequest) == std::vector<std::uint32_t>{17});
}

TEST_CASE("A closure that is too large leaves the former one in place") {
  Network network(3);
  network.link(kA, kC);
  network.run(1.0);
  network.cut(kA, kC);
  network.link(kB, kC);
  network.run(8.0);
  network.at(kB).wrote(OverlayStream::kInlierSet, {kA}, 0, octets(20), network.now_s());
  network.at(kB).wrote(OverlayStream::kInlierSet, {kA}, 0, octets(MessageStore::kMaxReliableBytes),
                       network.now_s());
  network.run(1.0);
  network.link(kA, kC);
  network.run(10.0);
  REQUIRE(network.read(kA, OverlayStream::kInlierSet).size() == 1);
  CHECK(network.all_read(kA).back()->content.size() == 20);
  CHECK(network.at(kB).given_up() == 1);
}

}  // namespace km
