#include "modules/link_emulation/link_emulator.hpp"

#include "test/support/test.hpp"

namespace km {
namespace {

constexpr std::size_t kFrame_bytes = 1000;

LinkScript script_of(std::size_t robots, const LinkPlan& link = {}) {
  LinkScript script{.robots = robots, .links = {}};
  script.links.assign(robots * robots, link);
  return script;
}

LinkPlan limited(double bytes_per_s, double delay_s = 0.0) {
  LinkPlan link;
  link.trace = LinkTrace({{0.0, bytes_per_s, delay_s}});
  return link;
}

EthernetFrame frame_to(std::size_t robot, std::size_t bytes = kFrame_bytes) {
  EthernetFrame frame(bytes, '.');
  const auto address = ethernet_address(robot);
  frame.replace(0, address.size(), reinterpret_cast<const char*>(address.data()), address.size());
  return frame;
}

EthernetFrame broadcast() {
  return EthernetFrame(kFrame_bytes, '\xFF');
}

EthernetFrame multicast() {
  return std::string("\x01\x00\x5E\x00\x00\x01", 6) + std::string(100, '.');
}

std::vector<SentFrame> all_of(LinkEmulator& emulator) {
  std::vector<SentFrame> all;
  while (const auto next_s = emulator.next_s())
    for (SentFrame& delivery : emulator.due(*next_s)) all.push_back(std::move(delivery));
  return all;
}

std::uint64_t lost(const LinkEmulator& emulator, LinkLoss why) {
  return emulator.counts(0, 1).lost[static_cast<std::size_t>(why)].frames;
}

// True if a frame from 0 to 1 at that time arrives.
bool passes(LinkEmulator& emulator, double time_s) {
  emulator.send(0, time_s, frame_to(1));
  return !emulator.due(time_s).empty();
}

}  // namespace

TEST_CASE("A broadcast frame goes to every other robot") {
  const EthernetFrame frame = GENERATE(broadcast(), multicast());
  LinkEmulator emulator(script_of(4));
  emulator.send(2, 0.0, frame);
  std::set<std::size_t> reached;
  for (const SentFrame& delivery : all_of(emulator)) reached.insert(delivery.to);
  CHECK(reached == std::set<std::size_t>{0, 1, 3});
}

TEST_CASE("A frame to an unknown address is dropped and not counted") {
  LinkEmulator emulator(script_of(2));
  emulator.send(0, 0.0, frame_to(7));
  emulator.send(0, 0.0, frame_to(0));
  emulator.send(0, 0.0, EthernetFrame(13, '\xFF'));
  CHECK(all_of(emulator).empty());
  CHECK(emulator.counts(0, 1) == LinkCounts{});
}

TEST_CASE("Frames arrive unchanged, after the exact delay, and jitter stays within its bounds") {
  LinkPlan link;
  link.trace = LinkTrace({{0.0, std::numeric_limits<double>::infinity(), 0.25}});
  LinkEmulator exact(script_of(2, link));
  exact.send(0, 3.0, frame_to(1));
  CHECK(exact.due(3.2499).empty());
  CHECK(exact.next_s() == 3.25);
  const auto deliveries = exact.due(3.25);
  REQUIRE(deliveries.size() == 1);
  CHECK(deliveries[0].frame == frame_to(1));
  CHECK(exact.counts(0, 1).delay_sum_s == 0.25);

  link.jitter_s = 0.1;
  LinkEmulator shaken(script_of(2, link));
  constexpr int kFrames = 2000;
  double sum_s = 0.0;
  for (int i = 0; i < kFrames; ++i) {
    shaken.send(0, i, frame_to(1));
    const auto due_s = shaken.next_s();
    REQUIRE(due_s);
    CHECK(*due_s >= i + 0.25);
    CHECK(*due_s <= i + 0.35);
    sum_s += *due_s - i;
    CHECK(shaken.due(*due_s).size() == 1);
  }
  // Mean of a uniform distribution; five standard deviations of the mean.
  CHECK(std::abs(sum_s / kFrames - 0.3) < 5.0 * 0.1 / std::sqrt(12.0 * kFrames));
}

TEST_CASE("The share of lost frames is the probability") {
  LinkPlan link{.loss = GENERATE(0.0, 0.05, 0.3, 1.0)};
  const unsigned seed = GENERATE(1, 2, 3);
  CAPTURE(link.loss, seed);
  LinkScript script = script_of(2, link);
  script.seed = seed;
  LinkEmulator emulator(script);
  constexpr int kFrames = 10000;
  for (int i = 0; i < kFrames; ++i) emulator.send(0, 0.0, frame_to(1));
  const double deviation = std::sqrt(kFrames * link.loss * (1.0 - link.loss));
  const auto count = static_cast<double>(lost(emulator, LinkLoss::kChance));
  CHECK(std::abs(count - kFrames * link.loss) <= 5.0 * deviation);
  CHECK(emulator.due(0.0).size() == kFrames - static_cast<std::size_t>(count));
}

TEST_CASE("A link carries its rate and no more") {
  LinkPlan link = limited(10e3, 0.5);
  link.queue_bytes = 1e9;
  LinkEmulator emulator(script_of(2, link));
  for (int i = 0; i < 50; ++i) emulator.send(0, 2.0, frame_to(1));
  const auto arrived = all_of(emulator);
  REQUIRE(arrived.size() == 50);
  for (std::size_t i = 0; i < arrived.size(); ++i)
    CHECK(arrived[i].due_s == Approx(2.5 + 0.1 * static_cast<double>(i + 1)).epsilon(1e-12));
  emulator.send(0, 100.0, frame_to(1));  // an idle link accumulates no capacity
  CHECK(*emulator.next_s() == Approx(100.6).epsilon(1e-12));
}

TEST_CASE("A full queue drops the newest frames") {
  LinkPlan link = limited(10e3);
  link.queue_bytes = 5.0 * kFrame_bytes;
  LinkEmulator emulator(script_of(2, link));
  for (int i = 0; i < 8; ++i) emulator.send(0, 0.0, frame_to(1));
  CHECK(lost(emulator, LinkLoss::kQueue) == 3);
  emulator.send(0, 0.05, frame_to(1));  // half a frame has been sent: there is no room yet
  CHECK(lost(emulator, LinkLoss::kQueue) == 4);
  emulator.send(0, 0.2, frame_to(1));  // room for two
  emulator.send(0, 0.2, frame_to(1));
  emulator.send(0, 0.2, frame_to(1));
  CHECK(lost(emulator, LinkLoss::kQueue) == 5);
  CHECK(all_of(emulator).size() == 7);
}

TEST_CASE("A queue waits while the rate of a trace is zero and then continues") {
  LinkPlan link;
  link.trace = LinkTrace({{0.0, 1000.0, 0.0},
                          {1.0, 1000.0, 0.0},
                          {1.1, 0.0, 0.0},
                          {4.9, 0.0, 0.0},
                          {5.0, 1000.0, 0.0}});
  LinkEmulator emulator(script_of(2, link));
  for (int i = 0; i < 2; ++i) emulator.send(0, 0.0, frame_to(1));
  const auto arrived = all_of(emulator);
  REQUIRE(arrived.size() == 2);
  CHECK(arrived[0].due_s == Approx(1.0));
  // 50 bytes each while the rate falls and rises, and 900 at the full rate.
  CHECK(arrived[1].due_s == Approx(5.9));
}

TEST_CASE("A recorded link carries a packet at each of its instants") {
  LinkPlan link = limited(1.0, 0.5);  // the rate does not count
  link.packets = PacketSchedule({0, 20, 20, 50});
  link.queue_bytes = 5500.0;
  LinkEmulator emulator(script_of(2, link));
  emulator.send(0, 0.010, frame_to(1, 1514));  // the instant at 0 is lost; 1500 bytes in the packet
  emulator.send(0, 0.010, frame_to(1, 764));
  emulator.send(0, 0.010, frame_to(1, 764));  // shares an instant with the one before
  emulator.send(0, 0.010, frame_to(1, 1015));
  emulator.send(0, 0.010, frame_to(1, 1014));  // begins at 50 ms and ends at 0 ms of the next round
  emulator.send(0, 0.010, frame_to(1, 1014));
  CHECK(lost(emulator, LinkLoss::kQueue) == 1);
  std::vector<double> due_s;
  for (const SentFrame& delivery : all_of(emulator)) due_s.push_back(delivery.due_s);
  REQUIRE(due_s.size() == 5);
  const double expected_s[] = {0.520, 0.520, 0.520, 0.550, 0.550};
  for (std::size_t i = 0; i < due_s.size(); ++i) CHECK(due_s[i] == Approx(expected_s[i]));
}

TEST_CASE("An outage begins and ends as planned for its direction") {
  LinkScript script = script_of(2);
  script.link(0, 1).outages = {{1.0, 2.0}, {5.0, 6.0}};
  LinkEmulator emulator(script);
  for (const auto& [time_s, expected] : std::vector<std::pair<double, bool>>{{0.0, true},
                                                                             {0.999, true},
                                                                             {1.0, false},
                                                                             {1.999, false},
                                                                             {2.0, true},
                                                                             {5.5, false},
                                                                             {6.0, true}}) {
    CAPTURE(time_s);
    CHECK(passes(emulator, time_s) == expected);
    emulator.send(1, time_s, frame_to(0));
    CHECK(emulator.due(time_s).size() == 1);
  }
  CHECK(lost(emulator, LinkLoss::kOutage) == 3);
}

TEST_CASE("A partition separates groups while it lasts") {
  LinkScript script = script_of(4);
  script.partitions = {{{10.0, 20.0}, {0, 0, 1, 1}}};
  LinkEmulator emulator(script);
  const auto reached = [&](double time_s) {
    emulator.send(0, time_s, broadcast());
    std::set<std::size_t> to;
    for (const SentFrame& delivery : emulator.due(time_s)) to.insert(delivery.to);
    return to;
  };
  CHECK(reached(9.0) == std::set<std::size_t>{1, 2, 3});
  CHECK(reached(10.0) == std::set<std::size_t>{1});
  CHECK(reached(20.0) == std::set<std::size_t>{1, 2, 3});
  const auto kPartition = static_cast<std::size_t>(LinkLoss::kPartition);
  CHECK(emulator.counts(0, 2).lost[kPartition] == FrameTally{1, kFrame_bytes});
  CHECK(emulator.counts(0, 1).lost[kPartition] == FrameTally{});
}

TEST_CASE("Robots receive each other within range") {
  LinkPlan link{.range_m = 5.0};
  LinkScript script = script_of(2, link);
  // They meet at 10 s, at 1 m/s each from 20 m, and stay there from 12 s on at 4 m.
  script.paths = {{{0.0, {0.0, 0.0, 1.0}}, {12.0, {12.0, 0.0, 1.0}}},
                  {{0.0, {20.0, 0.0, 1.0}}, {12.0, {8.0, 0.0, 1.0}}}};
  LinkEmulator emulator(script);
  CHECK_FALSE(passes(emulator, 0.0));
  CHECK_FALSE(passes(emulator, 7.49));
  CHECK(passes(emulator, 7.51));
  CHECK(passes(emulator, 10.0));
  CHECK(passes(emulator, 1000.0));
  CHECK(lost(emulator, LinkLoss::kRange) == 2);
}

TEST_CASE("A recording that waits moves its robot later") {
  LinkPlan link{.range_m = 5.0};
  LinkScript script = script_of(2, link);
  script.rate = 2.0;
  script.paths = {{{0.0, {0.0, 0.0, 0.0}}}, {{0.0, {0.0, 0.0, 0.0}}, {10.0, {10.0, 0.0, 0.0}}}};
  LinkEmulator emulator(script);
  CHECK(passes(emulator, 2.4));
  CHECK_FALSE(passes(emulator, 2.6));
  emulator.set_progress(1, 3.0, 4.0);  // it has waited for 1 s
  CHECK(passes(emulator, 3.4));
  CHECK_FALSE(passes(emulator, 3.6));
}

TEST_CASE("The loss of a pair's frames is independent of other links") {
  LinkPlan link{.loss = 0.5};
  const auto fates = [&](bool others) {
    LinkScript script = script_of(3, link);
    script.link(0, 1).outages = {{others ? 0.0 : 40.0, 50.0}};  // other losses for the same frames
    LinkEmulator emulator(script);
    std::string arrived;
    for (int i = 0; i < 100; ++i) {
      if (others) emulator.send(2, i, broadcast());
      if (others && i % 3 == 0) emulator.send(1, i, frame_to(0));
      emulator.send(0, i, frame_to(1));
      bool came = false;
      for (const SentFrame& delivery : emulator.due(i))
        came = came || (delivery.from == 0 && delivery.to == 1);
      if (i >= 50) arrived += came ? '+' : '-';
    }
    return arrived;
  };
  CHECK(fates(true) == fates(false));
}

TEST_CASE("A script that lacks something is refused") {
  using Change = void (*)(LinkScript&);
  const auto change = GENERATE(
      values<Change>({[](auto& script) { script.links.pop_back(); },
                      [](auto& script) { script.link(0, 1).range_m = 3.0; },  // without paths
                      [](auto& script) {
                        script.paths = {{}, {}};
                      },
                      [](auto& script) {
                        script.partitions = {{{}, {0}}};
                      },
                      [](auto& script) { script.link(0, 1).loss = 1.5; },
                      [](auto& script) { script.link(1, 0).jitter_s = std::nan(""); }}));
  LinkScript script = script_of(2);
  change(script);
  CHECK_THROWS_AS(LinkEmulator(script), std::invalid_argument);
}

TEST_CASE("The table of links has a row for each ordered pair") {
  LinkScript script = script_of(2);
  script.link(0, 1).trace = LinkTrace({{0.0, std::numeric_limits<double>::infinity(), 0.5}});
  script.link(1, 0).loss = 1.0;
  LinkEmulator emulator(script);
  emulator.send(0, 1.0, frame_to(1));
  emulator.send(1, 1.0, frame_to(0));
  REQUIRE(all_of(emulator).size() == 1);
  CHECK(links_csv(emulator, {"a", "b"}) ==
        "from,to,frames_in,bytes_in,frames_delivered,bytes_delivered,"
        "frames_partition,bytes_partition,frames_outage,bytes_outage,frames_range,bytes_range,"
        "frames_queue,bytes_queue,frames_loss,bytes_loss,delay_mean_s,delay_max_s\n"
        "a,b,1,1000,1,1000,0,0,0,0,0,0,0,0,0,0,0.5,0.5\n"
        "b,a,1,1000,0,0,0,0,0,0,0,0,0,0,1,1000,,\n");
}

}  // namespace km
