#include "test/runtime/dds/dds_fixture.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

std::uint64_t refusals(TestRobot& robot, const std::string& reason) {
  return robot.traffic(Direction::kIn).refused[reason];
}

TEST_CASE("Bytes that are no message are refused and later messages are received", "[gate]") {
  Two two;
  auto& [domain, a, b] = two;
  RawWriter writer(a.participant.handle(), domain->config(), TopicKind::kEvent);
  const auto seed = GENERATE(1U, 2U);
  std::mt19937 rng(seed);
  std::uniform_int_distribution<int> byte(0, 255), length(0, 300);
  constexpr std::uint32_t kCount = 200;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(length(rng)));
    for (std::uint8_t& x : bytes) x = static_cast<std::uint8_t>(byte(rng));
    km_wire_Envelope head = header(a.participant.identity(), i);
    head.key = i;
    writer.write_bytes(head, bytes);
  }
  writer.write(header(a.participant.identity(), kCount), {3, 7, {}});
  const auto pings = b.received.wait_until(
      [](const auto& p) { return std::ranges::count(p, 7U, &Ping::index) > 0; });
  CHECK_FALSE(pings.empty());
  CHECK(refusals(b, "not deserializable") > kCount / 2);
}

TEST_CASE("A message larger than its topic allows is not even read", "[gate]") {
  Two two;
  auto& [domain, a, b] = two;
  RawWriter writer(a.participant.handle(), domain->config(), TopicKind::kEvent);
  writer.write(header(a.participant.identity(), 0), {3, 0, std::vector<std::uint8_t>(200000)});
  CHECK(eventually([&] { return refusals(b, "larger than its topic allows") == 1; }));
  a.ping(1, std::vector<std::uint8_t>(200000));  // nor is it sent by a program that is sound
  CHECK(eventually([&] { return a.traffic(Direction::kOut).refused["too large"] == 1; }));
  a.ping(2);
  CHECK(b.received.wait_for(1)[0].index == 2);
}

TEST_CASE("Messages that a robot sent before it left are received", "[gate]") {
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, 3);
  std::promise<void> leave;
  const std::shared_future<void> left = leave.get_future();
  a.pings.from_peers().subscribe([left](const auto&) { left.wait(); });
  a.start();
  {
    TestRobot b(domain, 4);
    b.start();
    REQUIRE(b.receives(PeerEventKind::kJoined, 3));
    for (std::uint32_t i = 0; i < 50; ++i) b.ping(i);
    REQUIRE(eventually([&] { return b.traffic(Direction::kOut).count.messages == 50; }));
  }
  REQUIRE(a.receives(PeerEventKind::kLeft, 4));
  leave.set_value();
  CHECK(a.received.wait_for(50).size() == 50);
}

TEST_CASE("No participant can send in a robot's name, not even from a writer that is gone",
          "[gate]") {
  Two two;
  auto& [domain, a, b] = two;
  const bool shows_the_id = GENERATE(false, true);
  {
    const DdsEntity outsider = participant_with(
        domain->config(), shows_the_id ? to_user_data(a.participant.identity()) : "");
    RawWriter writer(outsider.handle(), domain->config(), TopicKind::kEvent);
    for (std::uint32_t i = 0; i < 60; ++i)
      writer.write(header(a.participant.identity(), 1000 + i), {3, 1000 + i, {}});
    REQUIRE(writer.is_read_by(2));
    REQUIRE(writer.is_acknowledged());
  }
  a.ping(1);
  REQUIRE(b.received.wait_for(1)[0].index == 1);
  CHECK(eventually([&] { return b.refused() == 60; }));
  CHECK(b.received.messages().size() == 1);
}

}  // namespace
}  // namespace km
