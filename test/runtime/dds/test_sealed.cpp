#include "runtime/clock.hpp"
#include "test/modules/security/toy_team.hpp"
#include "test/runtime/dds/dds_fixture.hpp"
#include "test/support/test.hpp"

namespace km {

// A message whose encoding blocks the sending thread.
struct Stone {
  std::shared_future<void> lifted;
};

template <>
struct Codec<Stone> : Codec<Ping> {
  static constexpr const char* kTopic = "stones";
  static MessageKey key_of(const Stone& /*stone*/) { return 0; }
  static Encoded encode(const Stone& stone) {
    stone.lifted.wait();
    return {};
  }
  static Decoded<Stone> decode(const Wire& /*wire*/, const TeamPeer& /*writer*/) {
    return Decoded<Stone>::refuse("nobody takes it");
  }
};

namespace {

std::int64_t today_s() {
  return static_cast<std::int64_t>(wall_now_s());
}

// Each process of a robot of the team, with keys that hold today.
TestRobot::MakeSeal member_of(const ToyTeam& team) {
  return [&team](const RobotIdentity& own) {
    return std::make_shared<SharedSeal>(team.keys_of(own.robot, own.name, today_s() - 3600), own,
                                        today_s());
  };
}

TEST_CASE("A robot without keys of the team is ignored and receives nothing", "[sealed]") {
  const ToyTeam team, others("survey");
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, 3, member_of(team)), b(domain, 4, member_of(team));
  const bool has_keys = GENERATE(false, true);
  TestRobot outsider(domain, 9, has_keys ? member_of(others) : TestRobot::MakeSeal());
  for (TestRobot* robot : {&a, &b, &outsider}) robot->start();
  REQUIRE(b.receives(PeerEventKind::kJoined, 3));
  CHECK(b.receives(PeerEventKind::kRefused, 9));
  outsider.ping(1);
  CHECK(eventually([&] { return b.refused() >= 1; }));
  a.ping(2, {42});
  REQUIRE(b.received.wait_for(1).size() == 1);
  CHECK(b.received.messages()[0].index == 2);
  CHECK(outsider.received.messages().empty());
  CHECK(b.bridge.peers().list().size() == 1);
}

TEST_CASE("Renewed writers send all events again, in a team with keys", "[sealed]") {
  const ToyTeam team;
  const bool has_keys = GENERATE(true, false);
  CAPTURE(has_keys);
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  const auto robot = [&](RobotId id) {
    return std::make_unique<TestRobot>(domain, new_process(id),
                                       has_keys ? member_of(team) : TestRobot::MakeSeal(),
                                       TopicKind::kEvent, TopicKind::kEvent);
  };
  const auto a = robot(3), b = robot(4);
  meet({a.get(), b.get()});
  a->ping(1);
  a->ping_one(4, 2);
  REQUIRE(b->received.wait_for(1).size() == 1);
  REQUIRE(b->received_addressed.wait_for(1).size() == 1);
  a->bridge.renew(4);
  const std::size_t copies = has_keys ? 2 : 1;
  CHECK(b->received.wait_for(copies).size() == copies);
  CHECK(b->received_addressed.wait_for(copies).size() == copies);
  a->ping(3);
  a->ping_one(4, 5);
  const auto all = [&](std::uint32_t first, std::uint32_t second) {
    return has_keys ? std::vector{first, first, second} : std::vector{first, second};
  };
  CHECK(indices(b->received.wait_for(copies + 1)) == all(1, 3));
  CHECK(indices(b->received_addressed.wait_for(copies + 1)) == all(2, 5));
  CHECK(b->refused() == 0);
  const auto late = robot(5);
  late->start();
  CHECK(indices(late->received.wait_for(2)) == std::vector<std::uint32_t>{1, 3});
}

TEST_CASE("Writers are not renewed while messages wait for the budget", "[sealed]") {
  const ToyTeam team;
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, new_process(3), member_of(team), TopicKind::kEvent, TopicKind::kEvent,
              {.bytes_per_s = 20'000.0});
  TestRobot b(domain, new_process(4), member_of(team), TopicKind::kEvent, TopicKind::kEvent);
  meet({&a, &b});
  a.ping_one(4, 2);
  REQUIRE(b.received_addressed.wait_for(1).size() == 1);
  for (std::uint32_t k = 0; k < 1000; ++k) a.ping(k, std::vector<std::uint8_t>(1000, 1));
  REQUIRE(eventually([&] { return a.bridge.holds_back(); }));
  a.bridge.renew(4);
  a.ping_one(4, 5);
  CHECK(indices(b.received_addressed.wait_for(2)) == std::vector<std::uint32_t>{2, 5});
}

// Reads the network as any participant in reach can.
TEST_CASE("Sealed messages cannot be read on their way", "[sealed]") {
  const ToyTeam team;
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, 3, member_of(team)), b(domain, 4, member_of(team));
  a.start();
  b.start();
  const DdsEntity ear(dds_create_participant(static_cast<dds_domainid_t>(domain->config().domain),
                                             nullptr, nullptr),
                      "participant");
  const dds_entity_t topic =
      dds_create_topic(ear.handle(), &km_wire_Envelope_desc, Codec<Ping>::kTopic, nullptr, nullptr);
  const dds_entity_t reader = dds_create_reader(
      ear.handle(), topic, make_reader_qos(TopicKind::kEvent, domain->config()).get(), nullptr);
  const std::vector<std::uint8_t> secret(500, 0x5A);
  a.ping(1, secret);
  REQUIRE(b.received.wait_for(1).size() == 1);

  km_wire_Envelope envelope{};
  void* sample = &envelope;
  dds_sample_info_t info{};
  REQUIRE(eventually([&] { return dds_take(reader, &sample, &info, 1, 1) == 1; }));
  const auto content = elements_of(envelope.content, 100000);
  REQUIRE(content);
  CHECK(content->size() > secret.size());
  CHECK(std::ranges::search(*content, std::vector<std::uint8_t>(8, 0x5A)).empty());
  dds_sample_free(&envelope, &km_wire_Envelope_desc, DDS_FREE_CONTENTS);
}

TEST_CASE("Replayed credentials and messages make no participant a member", "[sealed]") {
  const ToyTeam team;
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  auto b = std::make_unique<TestRobot>(domain, 4, member_of(team));
  // Records credentials and messages of robot 3, which then ends.
  std::string shown;
  const RobotIdentity identity = new_process(3);
  {
    TestRobot a(domain, identity, [&](const RobotIdentity& own) {
      auto seal = member_of(team)(own);
      shown = to_user_data(own, seal->credentials());
      return seal;
    });
    a.start();
    b->start();
    REQUIRE(b->receives(PeerEventKind::kJoined, 3));
    a.ping(1);
    REQUIRE(b->received.wait_for(1).size() == 1);
  }
  REQUIRE(b->receives(PeerEventKind::kLeft, 3));
  const DdsEntity impostor = participant_with(domain->config(), shown);
  RawWriter status(impostor.handle(), domain->config(), TopicKind::kStatus,
                   Codec<RobotStatus>::kTopic);
  RawWriter pings(impostor.handle(), domain->config(), TopicKind::kEvent);
  REQUIRE(status.is_read_by(1));
  REQUIRE(pings.is_read_by(1));
  for (std::uint32_t i = 0; i < 20; ++i) {
    status.write_bytes(header(identity, 100 + i), std::vector<std::uint8_t>(200, 1));
    pings.write(header(identity, 100 + i), {3, 100 + i, {}});
  }
  CHECK(eventually([&] { return b->refused() == 20; }));
  CHECK(eventually([&] { return b->refused(Codec<RobotStatus>::kTopic) > 0; }));
  TestRobot c(domain, 5, member_of(team));
  c.start();
  REQUIRE(b->receives(PeerEventKind::kJoined, 5));
  c.ping(2);
  REQUIRE(b->received.wait_for(2).size() == 2);
  CHECK(b->received.messages()[1].index == 2);
  CHECK_FALSE(TestRobot::matching(b->peer_events.messages(), PeerEventKind::kReturned, 3) > 0);
  REQUIRE(c.receives(PeerEventKind::kJoined, 4));
  CHECK(c.bridge.peers().list().size() == 1);
}

TEST_CASE("The later of two processes of one robot is notified and ignored", "[sealed]") {
  const ToyTeam team;
  const bool has_keys = GENERATE(true, false);
  CAPTURE(has_keys);
  const RobotKeys keys = team.keys_of(3, "robot3", today_s() - 3600);
  const TestRobot::MakeSeal no_keys;
  const TestRobot::MakeSeal its_keys = [&](const RobotIdentity& own) {
    return std::make_shared<SharedSeal>(keys, own, today_s());
  };
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, 3, has_keys ? its_keys : no_keys);
  TestRobot b(domain, 4, has_keys ? member_of(team) : no_keys);
  meet({&a, &b});
  REQUIRE(eventually([&] { return a.status_count() >= 4; }));
  TestRobot twin(domain, 3, has_keys ? its_keys : no_keys);
  twin.start();
  CHECK(twin.receives(PeerEventKind::kConflict, 3));
  CHECK(a.receives(PeerEventKind::kRefused, 3));
  CHECK(TestRobot::matching(a.peer_events.messages(), PeerEventKind::kConflict, 3) == 0);
  twin.ping(1);
  CHECK(eventually([&] { return a.refused() == 1 && b.refused() == 1; }));
  a.ping(2);
  REQUIRE(b.received.wait_for(1).size() == 1);
  CHECK(b.received.messages()[0].index == 2);
}

TEST_CASE("Messages under a new key wait for it, however many they are", "[sealed]") {
  ToyTeam team;
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, 3, member_of(team)), b(domain, 4, member_of(team));
  TestRobot c(domain, 5, member_of(team));
  meet({&a, &b, &c});
  const Revocations list = team.revoking({team.keys_of(9, "lost").certificate});
  REQUIRE(a.participant.seal()->with(
      [&](TeamSeal& seal) { return seal.update(list, today_s()).new_key; }));
  constexpr std::uint32_t kCount = 1500;
  for (std::uint32_t i = 0; i < kCount; ++i) a.ping(i);
  REQUIRE(eventually([&] { return a.traffic(Direction::kOut).count.messages == kCount; }));
  // b takes from both in turn: once it has all of c's, it has tried all of a's; and then again.
  for (std::uint32_t i = 0; i < 2 * kCount; ++i) c.ping(i);
  REQUIRE(b.received.wait_for(2 * kCount).size() == 2 * kCount);
  const std::uint64_t before = c.status_count();
  REQUIRE(eventually([&] { return c.status_count() > before + 1; }));
  a.bridge.send_keys();
  CHECK(b.received.wait_for(3 * kCount).size() == 3 * kCount);
  CHECK(b.refused() == 0);
}

TEST_CASE("A revoked robot is lost at once, and the others continue under a new key", "[sealed]") {
  ToyTeam team;
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, 3, member_of(team)), b(domain, 4, member_of(team));
  const RobotKeys revoked = team.keys_of(5, "robot5", today_s() - 3600);
  TestRobot c(domain, 5, [&](const RobotIdentity& own) {
    return std::make_shared<SharedSeal>(revoked, own, today_s());
  });
  for (TestRobot* robot : {&a, &b, &c}) robot->start();
  for (const RobotId robot : std::vector<RobotId>{3, 5})
    REQUIRE(b.receives(PeerEventKind::kJoined, robot));
  REQUIRE(a.receives(PeerEventKind::kJoined, 4));
  REQUIRE(a.receives(PeerEventKind::kJoined, 5));
  const Revocations list = team.revoking({revoked.certificate});
  for (TestRobot* robot : {&a, &b})
    robot->bridge.apply(robot->participant.seal()->with(
        [&](TeamSeal& seal) { return seal.update(list, today_s()); }));
  CHECK(a.receives(PeerEventKind::kLost, 5));
  CHECK(b.receives(PeerEventKind::kLost, 5));
  c.ping(1);
  CHECK(eventually([&] { return a.refused() == 1 && b.refused() == 1; }));
  a.ping(2);
  REQUIRE(b.received.wait_for(1).size() == 1);
  CHECK(b.received.messages()[0].index == 2);
  CHECK(c.received.messages().empty());
}

TEST_CASE("Robots appear and are received while sending is blocked", "[sealed]") {
  const ToyTeam team;
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, 3, member_of(team));
  Crossing<Stone> stones;
  a.bridge.exchange(stones, TopicKind::kEvent, TrafficCategory::kOther, {.receive = false});
  a.start();
  std::atomic<std::size_t> queued = 0;
  std::future<void> feeding;
  std::promise<void> lift;  // when it goes, too, before who waits for it
  feeding = std::async(std::launch::async, [&, stone = Stone{lift.get_future().share()}] {
    // One is being sent, and the last has no room.
    for (; queued < DdsBridge::kSendQueue + 2; ++queued) stones.to_peers().publish(stone);
  });
  // The rest of the queue is for what else the robot says meanwhile.
  REQUIRE(eventually([&] { return queued >= DdsBridge::kSendQueue * 9 / 10; }));
  TestRobot b(domain, 4, member_of(team));
  b.start();
  CHECK(a.receives(PeerEventKind::kJoined, 4));
  b.ping(7);
  CHECK(a.received.wait_for(1).size() == 1);
}

// A process that continues the incarnation of `former`, or one of another incarnation.
RobotIdentity successor_of(const RobotIdentity& former, bool resumed) {
  RobotIdentity next = former;
  next.boot = resumed ? next_boot(former.boot) : random_boot_id();
  return next;
}

TEST_CASE("Messages for a robot reach its resumed process and not its next incarnation",
          "[sealed]") {
  const ToyTeam team;
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  const TopicKind kind = GENERATE(TopicKind::kEvent, TopicKind::kState);
  const bool resumed = GENERATE(true, false), has_keys = GENERATE(true, false);
  CAPTURE(static_cast<int>(kind), resumed, has_keys);
  const auto make = [&](const RobotIdentity& identity) {
    return std::make_unique<TestRobot>(domain, identity,
                                       has_keys ? member_of(team) : TestRobot::MakeSeal(),
                                       TopicKind::kEvent, kind);
  };
  const auto a = make(new_process(3));
  const auto c = make(new_process(5));
  meet({a.get(), c.get()});
  const RobotIdentity former = new_process(4);
  {
    const auto first = make(former);
    first->start();
    REQUIRE(a->receives(PeerEventKind::kJoined, 4));
    a->ping_one(4, 0);
    a->ping_one(4, 1, {1});
    a->ping_one(4, 1, {2});  // takes the place of the one before
    const auto newest = [](const Ping& ping) { return ping.payload == Octets{2}; };
    REQUIRE(eventually(
        [&] { return std::ranges::any_of(first->received_addressed.messages(), newest); }));
  }
  REQUIRE(a->receives(PeerEventKind::kLeft, 4));
  a->ping_one(4, 2);  // while it is away
  a->ping_one(5, 0);  // arrives once the message before has been processed, too
  REQUIRE(c->received_addressed.wait_for(1).size() == 1);

  const RobotIdentity next = successor_of(former, resumed);
  const auto second = make(next);
  second->start();
  REQUIRE(a->receives(resumed ? PeerEventKind::kResumed : PeerEventKind::kRestarted, 4));
  const auto publish_for = [&](std::uint64_t boot, std::uint32_t index) {
    a->addressed_pings.to_peers().publish(
        {4, std::make_shared<const Ping>(Ping{3, index, {}}), boot});
  };
  publish_for(former.boot, 3);
  publish_for(next.boot, 4);
  const std::vector<Ping> pings = second->received_addressed.wait_for(resumed ? 5 : 1);
  CHECK(indices(pings) == (resumed ? up_to(5) : std::vector<std::uint32_t>{4}));
  const auto newest = std::ranges::find(pings, 1U, &Ping::index);
  CHECK((newest == pings.end() || newest->payload == Octets{2}));
  CHECK(second->refused() == 0);
  CHECK(a->traffic(Direction::kOut, true).refused.empty());
}

TEST_CASE("Messages for a robot of an earlier process wait until its keys are known", "[sealed]") {
  const ToyTeam team;
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  const RobotIdentity met = new_process(4);
  TestRobot a(domain, new_process(3), member_of(team), TopicKind::kEvent, TopicKind::kEvent);
  a.bridge.peers().tell(&PeerTable::recall, met);
  a.start();
  for (std::uint32_t i = 0; i < 3; ++i) a.ping_one(4, i);
  const std::uint64_t before = a.status_count();  // behind them in the queue
  REQUIRE(eventually([&] { return a.status_count() > before + 1; }));
  TestRobot b(domain, met, member_of(team), TopicKind::kEvent, TopicKind::kEvent);
  b.start();
  CHECK(indices(b.received_addressed.wait_for(3)) == up_to(3));
  CHECK(a.traffic(Direction::kOut, true).refused.empty());
}

}  // namespace
}  // namespace km
