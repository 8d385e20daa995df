#include "modules/sensors/lag_filter.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <stdexcept>

namespace km {
namespace {

constexpr Stamp kSecond = 1'000'000'000;
constexpr Stamp kImuPeriod = kSecond / 100;

// A packet at `t` with samples every 10 ms over the 50 ms up to it.
std::shared_ptr<const SensorPacket> packet_at(Stamp t) {
  auto frame = std::make_shared<StereoFrame>();
  frame->stamp = t;
  auto packet = std::make_shared<SensorPacket>();
  for (Stamp s = t - 5 * kImuPeriod; s <= t; s += kImuPeriod) packet->imu.emplace_back().stamp = s;
  packet->frame = std::move(frame);
  return packet;
}

}  // namespace

TEST_CASE("A packet in time passes as it is", "[sensors]") {
  LagFilter filter(0.2);
  const auto packet = packet_at(kSecond);
  CHECK(filter.take(packet, 0.2) == packet);
}

TEST_CASE("A late packet is given up, its samples come with the next", "[sensors]") {
  LagFilter filter(0.2);
  CHECK(filter.take(packet_at(kSecond), 0.3) == nullptr);
  CHECK(filter.take(packet_at(kSecond + 5 * kImuPeriod), 0.25) == nullptr);
  const auto joined = filter.take(packet_at(kSecond + 10 * kImuPeriod), 0.1);
  REQUIRE(joined);
  CHECK(joined->frame->stamp == kSecond + 10 * kImuPeriod);
  REQUIRE(joined->imu.size() == 16);  // 150 ms, no sample twice
  for (std::size_t i = 0; i < joined->imu.size(); ++i)
    CHECK(joined->imu[i].stamp == kSecond + (static_cast<Stamp>(i) - 5) * kImuPeriod);
  const auto next = packet_at(kSecond + 15 * kImuPeriod);
  CHECK(filter.take(next, 0.0) == next);
}

TEST_CASE("A lag without sense is refused", "[sensors]") {
  CHECK_THROWS_AS(LagFilter(-0.1), std::invalid_argument);
  CHECK_THROWS_AS(LagFilter(std::nan("")), std::invalid_argument);
}

}  // namespace km
