#include "runtime/dds/sequence_tracker.hpp"
#include "test/runtime/dds/dds_fixture.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

TEST_CASE("A message of one robot arrives at the other unchanged and once") {
  Two two;
  auto& [domain, a, b] = two;
  const std::vector<std::uint8_t> payload(70000, 42);
  for (std::uint32_t i = 0; i < 100; ++i) a.ping(i, i == 7 ? payload : std::vector<std::uint8_t>{});
  const auto pings = b.received.wait_for(100);
  CHECK(indices(pings) == up_to(100));
  const auto large = std::ranges::find(pings, 7U, &Ping::index);
  REQUIRE(large != pings.end());
  CHECK(large->payload == payload);
  CHECK(large->robot == 3);
  CHECK(a.received.messages().empty());  // a robot does not receive its own messages
}

TEST_CASE("A robot that joins late gets every event, request, and the newest state") {
  const auto kind = GENERATE(TopicKind::kEvent, TopicKind::kState, TopicKind::kRequest);
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, 3, kind), witness(domain, 4, kind);
  meet({&a, &witness});
  // Keys 0 and 1 each written twice.
  for (const std::uint8_t round : std::vector<std::uint8_t>{1, 2})
    for (const std::uint32_t key : {0U, 1U}) a.ping(key, {round});
  const auto is_last = [](const Ping& ping) { return ping.index == 1 && ping.payload[0] == 2; };
  REQUIRE(eventually([&] { return std::ranges::any_of(witness.received.messages(), is_last); }));

  TestRobot late(domain, 5, kind);
  late.start();
  REQUIRE(a.receives(PeerEventKind::kJoined, 5));
  a.ping(2);
  const auto pings = late.received.wait_for(3);
  CHECK(indices(pings) == up_to(3));
  for (const Ping& ping : pings)
    if (ping.index < 2) CHECK(ping.payload == std::vector<std::uint8_t>{2});
}

TEST_CASE("A request expires after the lease of a silent robot") {
  DdsConfig config = loopback_config();
  config.lease_s = 3.0;  // the shortest accepted
  const auto domain = std::make_shared<const DdsDomain>(config);
  TestRobot a(domain, 3, TopicKind::kRequest);
  a.start();
  a.ping(0);
  std::this_thread::sleep_for(std::chrono::milliseconds(3100));  // the lifespan under test
  TestRobot late(domain, 4, TopicKind::kRequest);
  late.start();
  REQUIRE(a.receives(PeerEventKind::kJoined, 4));
  a.ping(1);
  CHECK(indices(late.received.wait_for(1)) == std::vector<std::uint32_t>{1});
}

TEST_CASE("A repeated message is dropped") {
  Two two;
  auto& [domain, a, b] = two;
  for (std::uint32_t i = 0; i < 20; ++i) a.ping(i);
  REQUIRE(b.received.wait_for(20).size() == 20);

  RawWriter again(a.participant.handle(), domain->config(), TopicKind::kEvent);
  for (std::uint32_t i = 0; i < 20; ++i)
    again.write(header(a.participant.identity(), i), {3, i, {}});
  CHECK(eventually([&] { return b.traffic(Direction::kIn).duplicates == 20; }));
  CHECK(b.received.messages().size() == 20);
  CHECK(b.traffic(Direction::kIn).count.messages == 20);
}

TEST_CASE("An addressed message reaches its addressee and no other robot gets a byte of it") {
  const auto kind = GENERATE(TopicKind::kRequest, TopicKind::kEvent);
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, 3, kind, kind), b(domain, 4, kind, kind), c(domain, 5, kind, kind);
  meet({&a, &b, &c});

  for (std::uint32_t i = 0; i < 10; ++i) a.ping_one(4, i, std::vector<std::uint8_t>(1000));
  CHECK(indices(b.received_addressed.wait_for(10)) == up_to(10));
  a.ping_one(5, 77);
  CHECK(indices(c.received_addressed.wait_for(1)) == std::vector<std::uint32_t>{77});

  CHECK(c.traffic(Direction::kIn, true).count.messages == 1);
  REQUIRE(eventually([&] { return a.traffic(Direction::kOut, true).count.messages == 11; }));
  CHECK(a.traffic_with(4, Direction::kOut, true).messages == 10);
  CHECK(a.traffic_with(5, Direction::kOut, true).messages == 1);
  CHECK(a.traffic_with(4, Direction::kOut, true) == b.traffic_with(3, Direction::kIn, true));
  CHECK(a.traffic_with(5, Direction::kOut, true) == c.traffic_with(3, Direction::kIn, true));
  CHECK(a.traffic(Direction::kOut).count.messages == 0);
}

TEST_CASE("Earlier messages for a robot that joins late are counted once") {
  const auto kind = GENERATE(TopicKind::kEvent, TopicKind::kState);
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, 3, kind), b(domain, 4, kind);
  meet({&a, &b});
  for (std::uint32_t i = 0; i < 50; ++i) a.ping(i, std::vector<std::uint8_t>(1000));
  const std::uint32_t newer = kind == TopicKind::kState ? 25 : 0;
  for (std::uint32_t i = 0; i < newer; ++i) a.ping(i, std::vector<std::uint8_t>(2000));
  REQUIRE(eventually([&] { return a.traffic(Direction::kOut).count.messages == 50 + newer; }));
  TestRobot late(domain, 5, kind);
  late.start();
  REQUIRE(late.received.wait_for(50).size() == 50);
  CHECK(eventually(
      [&] { return a.traffic_with(5, Direction::kOut) == late.traffic_with(3, Direction::kIn); }));
  CHECK(a.traffic_with(5, Direction::kOut).messages == 50);
  for (const PeerTraffic& row : a.bridge.traffic().peers) CHECK(row.retransmitted_bytes == 0);
}

TEST_CASE("Messages of a hostile peer are counted by reason and change nothing") {
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, 3), b(domain, 4), foe(domain, 9);
  meet({&a, &b, &foe});

  RawWriter writer(foe.participant.handle(), domain->config(), TopicKind::kEvent);
  const RobotIdentity self = foe.participant.identity();
  RobotIdentity other_boot = self;
  other_boot.boot ^= 1U;
  km_wire_Envelope no_version = header(self, 3);
  no_version.version = 0;
  writer.write(header(a.participant.identity(), 0), {9, 0, {}});
  writer.write(header(b.participant.identity(), 0), {9, 1, {}});
  writer.write(header(other_boot, 0), {9, 2, {}});
  writer.write(no_version, {9, 3, {}});
  writer.write(header(self, 4), {9, 4, {0xFF}});
  writer.write(header(self, 0), {9, 5, {}});

  CHECK(indices(b.received.wait_for(1)) == std::vector<std::uint32_t>{5});
  const std::map<std::string, std::uint64_t> expected{{"claims another robot's id", 3},
                                                      {"unknown version of the topic", 1},
                                                      {"payload starts with 0xFF", 1}};
  CHECK(eventually([&] { return b.traffic(Direction::kIn).refused == expected; }));
  a.ping(0);  // the number that the foe tried to use up
  CHECK(b.received.wait_for(2).size() == 2);
  CHECK(b.bridge.error() == nullptr);
}

TEST_CASE("Messages of a new incarnation wait until all nodes know that the robot has restarted") {
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, 3);
  std::mutex mutex;
  Topic<PeerEvent>::Message held;
  a.bridge.peers().events().subscribe([&](const auto& event) {
    const std::lock_guard lock(mutex);
    if (event->kind == PeerEventKind::kRestarted) held = event;
  });
  a.start();
  {
    TestRobot first(domain, 4);
    first.start();
    first.ping(0);
    REQUIRE(a.received.wait_for(1).size() == 1);
  }
  REQUIRE(a.receives(PeerEventKind::kLeft, 4));
  TestRobot second(domain, 4);
  second.ping(1);
  second.start();
  REQUIRE(second.receives(PeerEventKind::kJoined, 3));
  REQUIRE(a.receives(PeerEventKind::kRestarted, 4));
  std::this_thread::sleep_for(std::chrono::milliseconds(700));  // enough for it to arrive
  CHECK(a.received.messages().size() == 1);
  {
    const std::lock_guard lock(mutex);
    held.reset();
  }
  CHECK(a.received.wait_for(2).size() == 2);
}

TEST_CASE("A subscriber that throws does not stop the robot from receiving") {
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, 3), b(domain, 4);
  b.pings.from_peers().subscribe([](const auto& ping) {
    if (ping->index == 0) throw std::runtime_error("subscriber");
  });
  meet({&a, &b});
  a.ping(0);
  a.ping(1);
  CHECK(b.received.wait_for(2).size() == 2);
  CHECK(eventually(
      [&] { return b.traffic(Direction::kIn).refused["its handling threw an exception"] == 1; }));
}

TEST_CASE("Duplicates agree with a set of all numbers, in any order") {
  const auto seed = GENERATE(range(0U, 50U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::uniform_int_distribution<std::uint32_t> number(5, 200);
  SequenceTracker tracker;
  std::set<std::uint32_t> seen;
  for (int i = 0; i < 300; ++i) {
    const std::uint32_t n = number(rng);
    REQUIRE(tracker.is_new(n) == seen.insert(n).second);
  }
}

TEST_CASE("A stream that skips every other number does not exhaust the memory") {
  constexpr std::uint32_t kCount = 10 * SequenceTracker::kMaxIntervals;
  SequenceTracker tracker;
  for (std::uint32_t i = 0; i < kCount; ++i) CHECK(tracker.is_new(2 * i + 1));
  CHECK_FALSE(tracker.is_new(2 * kCount - 1));  // a late duplicate
  CHECK(tracker.is_new(2 * kCount - 2));        // a late gap filled
  CHECK_FALSE(tracker.is_new(2));               // given up: better lost than twice
}

}  // namespace
}  // namespace km
