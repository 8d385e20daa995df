#include "modules/link_emulation/packet_schedule.hpp"

#include <catch2/catch.hpp>
#include <stdexcept>
#include <string>

#include "modules/link_emulation/link_trace.hpp"
#include "test/support/corrupted_input.hpp"

namespace km {
namespace {

std::string schedule_refusal(const std::string& text) {
  try {
    static_cast<void>(parse_packet_schedule(text, "radio.up"));
  } catch (const LinkTraceError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("A packet schedule carries 1500 bytes at each instant and repeats", "[link_emulation]") {
  const PacketSchedule schedule = parse_packet_schedule("0\n57\n57\n100\n", "radio.up");
  CHECK(schedule.capacity_until(0.0) == 1500.0);
  CHECK(schedule.capacity_until(0.0569) == 1500.0);
  CHECK(schedule.capacity_until(0.057) == 4500.0);
  CHECK(schedule.capacity_until(0.0999) == 4500.0);
  CHECK(schedule.capacity_until(0.1) ==
        7500.0);  // the last instant, and the first of the next round
  CHECK(schedule.capacity_until(0.157) == 10500.0);
  CHECK(schedule.capacity_until(100.0) == 1000.0 * 6000.0 + 1500.0);
  CHECK(schedule.time_of(0.0) == 0.0);
  CHECK(schedule.time_of(1500.0) == 0.0);
  CHECK(schedule.time_of(1501.0) == 0.057);
  CHECK(schedule.time_of(4500.0) == 0.057);
  CHECK(schedule.time_of(6000.0) == 0.1);
  CHECK(schedule.time_of(7500.0) == 0.1);
  CHECK(schedule.time_of(1000.0 * 6000.0 + 3000.0) == 100.057);
  for (int packet = 1; packet < 5000; ++packet) {
    const double time_s = schedule.time_of(PacketSchedule::kPacket_bytes * packet);
    CHECK(schedule.capacity_until(time_s) >= PacketSchedule::kPacket_bytes * packet);
  }
}

TEST_CASE("An error in a packet schedule is reported with its line", "[link_emulation]") {
  CHECK(schedule_refusal("") == "radio.up: the last time is 0 or missing");
  CHECK(schedule_refusal("0\n0\n") == "radio.up: the last time is 0 or missing");
  CHECK(schedule_refusal("1\n2 3\n") == "radio.up:2: 2 fields, expected a time");
  CHECK(schedule_refusal("1\n2.5\n") == "radio.up:2: 2.5 is not a whole number of milliseconds");
  CHECK(schedule_refusal("1\n-2\n") == "radio.up:2: -2 is not a whole number of milliseconds");
  CHECK(schedule_refusal("1\n4294967296\n") ==
        "radio.up:2: 4294967296 is not a whole number of milliseconds");
  CHECK(schedule_refusal("5\n4\n") == "radio.up:2: 4 is before the time above it");
  CHECK_THROWS_AS(PacketSchedule({3, 2}), std::invalid_argument);
  check_no_files<LinkTraceError>(".up", [](const auto& file) { (void)read_packet_schedule(file); });
  check_corrupted<LinkTraceError>("0\n48\n57\n57\n58\n", "radio.up", [](const auto& text) {
    const PacketSchedule schedule = parse_packet_schedule(text, "radio.up");
    CHECK(schedule.capacity_until(schedule.time_of(1e6)) >= 1e6);
  });
}

}  // namespace km
