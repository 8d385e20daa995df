#include "modules/link_emulation/link_trace.hpp"

#include "test/support/corrupted_input.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

template <typename Parse>
std::string refusal(const Parse& parse, const std::string& text) {
  try {
    static_cast<void>(parse(text, "trace.csv"));
  } catch (const LinkTraceError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("A link trace is a straight line between its rows") {
  const LinkTrace trace =
      parse_link_trace("time_s,bytes_per_s,delay_s\n10,100,0.1\n20,300,0.5\n", "trace.csv");
  REQUIRE(trace.has_limit());
  CHECK(trace.delay_s(0.0) == 0.1);
  CHECK(trace.delay_s(10.0) == 0.1);
  CHECK(trace.delay_s(15.0) == Approx(0.3));
  CHECK(trace.delay_s(20.0) == 0.5);
  CHECK(trace.delay_s(99.0) == 0.5);
  // 100 B/s before, a mean of 150 B/s over the first half, of 200 over all, 300 after.
  CHECK(trace.capacity_until(8.0) == Approx(-200.0));
  CHECK(trace.capacity_until(10.0) == 0.0);
  CHECK(trace.capacity_until(15.0) == Approx(750.0));
  CHECK(trace.capacity_until(20.0) == Approx(2000.0));
  CHECK(trace.capacity_until(22.0) == Approx(2600.0));
}

TEST_CASE("The time of a capacity is the first time at which it is reached") {
  const LinkTrace trace({{0.0, 50.0, 0.0}, {4.0, 0.0, 0.0}, {6.0, 0.0, 0.0}, {9.0, 80.0, 0.0}});
  std::mt19937 rng(1);
  std::uniform_real_distribution<double> time_s(-5.0, 15.0);
  for (int i = 0; i < 1000; ++i) {
    const double t = time_s(rng);
    CAPTURE(t);
    const double bytes = trace.capacity_until(t);
    // If the rate is zero, times closer than the root of the rounding are indistinguishable.
    if (t < 3.99 || t > 6.01) CHECK(trace.time_of(bytes) == Approx(t).margin(1e-9));
    CHECK(trace.capacity_until(trace.time_of(bytes)) == Approx(bytes).margin(1e-9));
  }
  CHECK(trace.time_of(100.0) == Approx(4.0));  // the first such time: no more until 6 s
  CHECK(LinkTrace({{0.0, 10.0, 0.0}, {2.0, 0.0, 0.0}}).time_of(10.5) == kInfinite);
}

TEST_CASE("An error in a link trace is reported with its line") {
  CHECK(refusal(parse_link_trace, "") == "trace.csv: has no row");
  CHECK(refusal(parse_link_trace, "time_s,bytes_per_s,delay_s\n") == "trace.csv: has no row");
  CHECK(refusal(parse_link_trace, "0,1,0\n1,2\n") ==
        "trace.csv:2: 2 fields, expected time_s, bytes_per_s, delay_s");
  CHECK(refusal(parse_link_trace, "0,1,0\n1,x,0\n") == "trace.csv:2: x is not a finite number");
  CHECK(refusal(parse_link_trace, "0,1,0\n1,inf,0\n") == "trace.csv:2: inf is not a finite number");
  CHECK(refusal(parse_link_trace, "# as measured\n0,1,0\n\n1,-2,0\n") ==
        "trace.csv:4: bytes_per_s is below zero");
  CHECK(refusal(parse_link_trace, "0,1,-1\n") == "trace.csv:1: delay_s is below zero");
  CHECK(refusal(parse_link_trace, "5,1,0\n5,2,0\n") ==
        "trace.csv:2: time_s is not after that of the row before");
}

TEST_CASE("A missing link trace is refused by name") {
  check_no_files<LinkTraceError>(".csv", [](const auto& file) { (void)read_link_trace(file); });
}

TEST_CASE("A corrupted link trace is refused by name or usable") {
  check_corrupted<LinkTraceError>(
      "time_s,bytes_per_s,delay_s\n0,125000,0.02\n1.5,60000,0.05\n3,0,0.2\n4,9000,0.1\n",
      "trace.csv", [](const std::string& text) {
        const LinkTrace trace = parse_link_trace(text, "trace.csv");
        CHECK(trace.delay_s(2.0) >= 0.0);
        CHECK_FALSE(std::isnan(trace.time_of(trace.capacity_until(2.0) + 1500.0)));
      });
}

TEST_CASE("A packet schedule carries 1500 bytes at each instant and repeats") {
  const PacketSchedule schedule = parse_packet_schedule("0\n57\n57\n100\n", "trace.csv");
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

TEST_CASE("An error in a packet schedule is reported with its line") {
  CHECK(refusal(parse_packet_schedule, "") == "trace.csv: the last time is 0 or missing");
  CHECK(refusal(parse_packet_schedule, "0\n0\n") == "trace.csv: the last time is 0 or missing");
  CHECK(refusal(parse_packet_schedule, "1\n2 3\n") == "trace.csv:2: 2 fields, expected a time");
  CHECK(refusal(parse_packet_schedule, "1\n2.5\n") ==
        "trace.csv:2: 2.5 is not a whole number of milliseconds");
  CHECK(refusal(parse_packet_schedule, "1\n-2\n") ==
        "trace.csv:2: -2 is not a whole number of milliseconds");
  CHECK(refusal(parse_packet_schedule, "1\n4294967296\n") ==
        "trace.csv:2: 4294967296 is not a whole number of milliseconds");
  CHECK(refusal(parse_packet_schedule, "5\n4\n") == "trace.csv:2: 4 is before the time above it");
  CHECK_THROWS_AS(PacketSchedule({3, 2}), std::invalid_argument);
  check_no_files<LinkTraceError>(".up", [](const auto& file) { (void)read_packet_schedule(file); });
  check_corrupted<LinkTraceError>("0\n48\n57\n57\n58\n", "trace.csv", [](const auto& text) {
    const PacketSchedule schedule = parse_packet_schedule(text, "trace.csv");
    CHECK(schedule.capacity_until(schedule.time_of(1e6)) >= 1e6);
  });
}

}  // namespace km
