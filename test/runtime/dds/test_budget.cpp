#include <catch2/catch.hpp>

#include <iostream>

#include "runtime/clock.hpp"
#include "test/runtime/dds/dds_fixture.hpp"

namespace km {
namespace {

// Robot 3 with a budget and robot 4, which have joined. Messages to all count as words, messages to
// one robot as closures.
struct Thrifty {
  explicit Thrifty(const BudgetConfig& budget)
      : a(domain, {3, robot_name(3), kProtocolVersion, random_boot_id()}, nullptr,
          TopicKind::kEvent, TopicKind::kEvent, budget) {
    a.start();
    b.start();
    REQUIRE(a.receives(PeerEventKind::kJoined, 4));
    REQUIRE(b.receives(PeerEventKind::kJoined, 3));
  }

  void offer(std::uint32_t count, std::size_t bytes) {
    for (std::uint32_t k = 0; k < count; ++k) a.ping(k, std::vector<std::uint8_t>(bytes, 1));
  }
  // All that robot 3 has sent.
  [[nodiscard]] double sent_bytes() const {
    const TrafficSnapshot traffic = a.bridge.traffic();
    std::uint64_t bytes = 0;
    for (const PeerTraffic& row : traffic.peers)
      if (row.direction == Direction::kOut) bytes += row.count.bytes + row.retransmitted_bytes;
    return static_cast<double>(bytes);
  }

  std::shared_ptr<const DdsDomain> domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a;
  TestRobot b{domain, 4, TopicKind::kEvent, TopicKind::kEvent};
};

TEST_CASE(
    "A robot with more messages than its budget permits sends as much as the budget and no more",
    "[dds][budget]") {
  constexpr double kRate = 100'000.0, kSeconds = 5.0;
  Thrifty team({.bytes_per_s = kRate});
  const double from_s = steady_now_s();
  const double before = team.sent_bytes();
  team.offer(8000, 1000);  // for 80 s
  // On a machine that does nothing else the first 5 s will do.
  double share = 0.0;
  for (int window = 0; window < 10 && share < 0.95; ++window) {
    const double start_s = steady_now_s(), start_bytes = team.sent_bytes();
    REQUIRE(eventually([&] { return steady_now_s() - start_s >= kSeconds; }));
    share = (team.sent_bytes() - start_bytes) / (kRate * (steady_now_s() - start_s));
  }
  std::cout << "sent " << share << " of the budget\n";
  CHECK(share > 0.95);
  const double bytes = team.sent_bytes() - before;  // before the clock is read: a test may wait
  CHECK(bytes < 1.05 * kRate * (steady_now_s() - from_s));
  CHECK(team.a.bridge.holds_back());
  const HeldBack held = team.a.traffic(Direction::kOut).held;
  CHECK(held.waiting.messages > 0);
  CHECK(held.delayed.messages > 0);
  CHECK(held.dropped.messages == 0);
}

TEST_CASE("Delayed and dropped messages add up and the total of a run is observed",
          "[dds][budget]") {
  constexpr double kTotal = 1e6;
  Thrifty team({.bytes_per_run = kTotal});
  constexpr std::uint32_t kOffered = 200;
  team.offer(kOffered, 10'000);
  const auto words = [&] { return team.a.traffic(Direction::kOut); };
  REQUIRE(eventually(
      [&] { return words().count.messages + words().held.dropped.messages == kOffered; }));
  // 80 % of it are for words.
  CHECK(static_cast<double>(words().count.bytes) < 0.8 * kTotal);
  CHECK(static_cast<double>(words().count.bytes) > 0.95 * 0.8 * kTotal);
  CHECK(words().held.waiting.messages == 0);
  CHECK(words().held.dropped.bytes ==
        words().held.dropped.messages * words().count.bytes / words().count.messages);
  team.a.ping_one(4, 77, std::vector<std::uint8_t>(10'000, 1));
  CHECK(team.b.received_addressed.wait_for(1).size() == 1);
}

}  // namespace
}  // namespace km
