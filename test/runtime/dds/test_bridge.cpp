#include <catch2/catch.hpp>

#include <algorithm>
#include <numeric>

#include "test/runtime/dds/dds_fixture.hpp"

namespace km {
namespace {

std::vector<std::uint32_t> indices(const std::vector<Ping>& pings) {
  std::vector<std::uint32_t> result;
  for (const Ping& ping : pings) result.push_back(ping.index);
  std::ranges::sort(result);
  return result;
}

std::vector<std::uint32_t> up_to(std::uint32_t count) {
  std::vector<std::uint32_t> result(count);
  std::iota(result.begin(), result.end(), 0U);
  return result;
}

TEST_CASE("What one robot publishes arrives at the other, unchanged and once", "[dds]") {
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, 3);
  TestRobot b(domain, 60000);
  a.start();
  b.start();
  REQUIRE(a.hears(PeerEventKind::kJoined, 60000));
  REQUIRE(b.hears(PeerEventKind::kJoined, 3));

  const std::vector<std::uint8_t> payload(70000, 42);
  for (std::uint32_t i = 0; i < 100; ++i) a.ping(i, i == 7 ? payload : std::vector<std::uint8_t>{});
  const auto pings = b.received.wait_for(100);
  CHECK(indices(pings) == up_to(100));
  const auto large = std::ranges::find(pings, 7U, &Ping::index);
  REQUIRE(large != pings.end());
  CHECK(large->payload == payload);
  CHECK(large->robot == 3);
  CHECK(a.received.messages().empty());  // nobody hears himself
}

}  // namespace
}  // namespace km
