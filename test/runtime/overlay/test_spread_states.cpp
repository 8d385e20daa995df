#include <catch2/catch.hpp>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "runtime/overlay/overlay.hpp"
#include "test/runtime/overlay/overlay_network.hpp"

namespace km {
namespace {

constexpr OverlayStream kPoses = OverlayStream::kMemberPoses;
using Pairs = std::vector<std::pair<RobotId, RobotId>>;

RobotIdentity robot(RobotId id, std::uint64_t boot = 1) {
  return {.robot = id, .name = name_of(id), .boot = boot};
}

// Overlays whose messages arrive at once; the class records the messages that are new to a robot.
// Own links and summaries do not count as sent.
struct Overlays {
  std::map<RobotId, Overlay> of = {};
  std::set<std::pair<RobotId, RobotId>> links = {};
  std::map<RobotId, std::vector<OverlayMessagePtr>> read = {};
  std::map<RobotId, int> sent = {};
  bool losing = false;
  double now_s = 0.0;

  explicit Overlays(const Pairs& pairs) {
    for (const auto& [a, b] : pairs) up(a, b);
    run(10);
    forget();
  }
  Overlay& at(RobotId id) { return of.try_emplace(id, TeamPeer{id, 1}).first->second; }
  void up(RobotId a, RobotId b) {
    links.insert({{a, b}, {b, a}});
    at(a).connected(robot(b), now_s);
    at(b).connected(robot(a), now_s);
  }
  void down(RobotId a, RobotId b) {
    links.erase({a, b});
    links.erase({b, a});
    at(a).lost(b, now_s);
    at(b).lost(a, now_s);
  }
  // Periods of a summary of every robot.
  void run(int periods, double period_s = kPeriod_s) {
    for (int k = 0; k < periods; ++k) {
      now_s += period_s;
      for (auto& [id, overlay] : of) overlay.step(now_s);
      carry();
      for (const auto& [a, b] : std::set(links)) at(b).update(a, at(a).summary(), now_s);
      carry();
    }
  }
  void carry() {
    std::deque<std::pair<RobotId, OverlayPacket>> on_the_way;
    const auto collect = [&] {
      for (auto& [id, overlay] : of) {
        OverlayOutput output = overlay.take_output();
        for (OverlayPacket& packet : output.packets) {
          const bool is_link = packet.message->stream == OverlayStream::kLinks && packet.is_own;
          sent[id] += is_link ? 0 : 1;
          on_the_way.emplace_back(id, std::move(packet));
        }
        for (OverlayMessagePtr& message : output.delivered) read[id].push_back(std::move(message));
      }
    };
    for (collect(); !on_the_way.empty(); collect()) {
      const auto [from, packet] = on_the_way.front();
      on_the_way.pop_front();
      if (!links.contains({from, packet.neighbour}) || losing) continue;
      (void)at(packet.neighbour).receive(robot(from), packet.message, now_s);
    }
  }
  void publish(RobotId id, std::uint8_t content = 7) {
    at(id).publish(kPoses, {content}, now_s);
    carry();
  }
  bool call(RobotId from, RobotId to) {
    const bool sends = at(from).call(OverlayStream::kSolver, to, 0, {1, 2, 3});
    carry();
    return sends;
  }
  void forget() {
    read.clear();
    sent.clear();
  }
  std::size_t poses_read(RobotId id) {
    return static_cast<std::size_t>(std::ranges::count_if(
        read[id], [](const auto& message) { return message->stream == kPoses; }));
  }
  int total_sent() {
    int total = 0;
    for (const auto& [id, count] : sent) total += count;
    return total;
  }
};

OverlayArrival receive(Overlay& overlay, const RobotIdentity& from, OverlayMessage message) {
  return overlay.receive(from, std::make_shared<const OverlayMessage>(std::move(message)), 0.0);
}

OverlayMessage introduction(TeamPeer origin) {
  return {.origin = origin, .content = {'r'}};
}

}  // namespace

TEST_CASE("all robots receive each state once, over any links", "[overlay]") {
  const Pairs pairs = GENERATE(Pairs{{1, 2}, {2, 3}, {3, 4}, {4, 5}, {5, 6}},
                               Pairs{{1, 6}, {2, 6}, {3, 6}, {4, 6}, {5, 6}},
                               Pairs{{1, 2}, {2, 3}, {3, 4}, {4, 5}, {5, 6}, {1, 6}},
                               Pairs{{1, 2}, {1, 3}, {2, 3}, {3, 4}, {4, 5}, {4, 6}, {5, 6}});
  Overlays overlays(pairs);
  for (const RobotId id : {RobotId{1}, RobotId{3}, RobotId{6}}) overlays.publish(id);
  for (const auto& [id, overlay] : overlays.of) {
    CAPTURE(id);
    const std::size_t own = id == 1 || id == 3 || id == 6 ? 1 : 0;
    CHECK(overlays.poses_read(id) == 3 - own);
  }
}

TEST_CASE("nothing is forwarded if all robots receive each other", "[overlay]") {
  Pairs pairs;
  for (RobotId a = 1; a <= 6; ++a)
    for (RobotId b = 1; b < a; ++b) pairs.emplace_back(a, b);
  Overlays overlays(pairs);
  overlays.publish(2);
  CHECK(overlays.total_sent() == 5);
  for (const RobotId id : std::vector<RobotId>{1, 3, 4, 5, 6}) CHECK(overlays.poses_read(id) == 1);
  overlays.forget();
  overlays.run(100);
  CHECK(overlays.total_sent() == 0);
}

TEST_CASE("a full team whose robots all appear at once forwards nothing", "[overlay]") {
  Overlays overlays({});
  for (RobotId a = 1; a <= kMaxTeam; ++a)
    for (RobotId b = 1; b < a; ++b) overlays.up(a, b);
  overlays.run(10);
  CHECK(overlays.total_sent() == 0);
  overlays.publish(2);
  CHECK(overlays.total_sent() == static_cast<int>(kMaxTeam) - 1);
}

TEST_CASE("the states of a full team reach all robots of a line", "[overlay]") {
  Overlays overlays({});
  for (RobotId id = 1; id < kMaxTeam; ++id) overlays.up(id, static_cast<RobotId>(id + 1));
  overlays.run(200);
  overlays.forget();
  overlays.publish(1);
  CHECK(overlays.poses_read(kMaxTeam) == 1);
  CHECK(overlays.total_sent() == static_cast<int>(kMaxTeam) - 1);
}

TEST_CASE("in a line of robots, each state passes each link once", "[overlay]") {
  Overlays overlays({{1, 2}, {2, 3}, {3, 4}, {4, 5}});
  overlays.publish(3);
  CHECK(overlays.total_sent() == 4);
}

TEST_CASE("a robot with a new link receives all present states", "[overlay]") {
  Overlays overlays({{1, 2}, {2, 3}});
  overlays.publish(1);
  overlays.publish(3);
  overlays.up(3, 4);
  overlays.run(1);
  CHECK(overlays.poses_read(4) == 2);
}

TEST_CASE("in a line of robots that have just met, a state waits once and not at each link",
          "[overlay]") {
  Overlays overlays({});
  for (RobotId id = 1; id < 6; ++id) overlays.up(id, static_cast<RobotId>(id + 1));
  overlays.publish(1);
  overlays.run(1, 0.5 * SpreadStates::kMeeting_s);
  CHECK(overlays.poses_read(2) == 1);
  CHECK(overlays.poses_read(3) == 0);
  overlays.run(1, 0.6 * SpreadStates::kMeeting_s);
  CHECK(overlays.poses_read(6) == 1);
}

TEST_CASE("a robot that meets all others in a tenth of a second is not introduced", "[overlay]") {
  Pairs pairs;
  for (RobotId a = 1; a <= 5; ++a)
    for (RobotId b = 1; b < a; ++b) pairs.emplace_back(a, b);
  Overlays overlays(pairs);
  for (RobotId id = 1; id <= 5; ++id) {
    overlays.up(id, 9);
    overlays.run(1, 0.02);
  }
  overlays.run(20);
  CHECK(overlays.total_sent() == 0);
}

TEST_CASE("a lost state is sent again when the hashes show its loss", "[overlay]") {
  Overlays overlays({{1, 2}, {2, 3}, {3, 4}});
  overlays.losing = true;
  overlays.publish(1);
  overlays.losing = false;
  overlays.forget();
  overlays.run(24);
  CHECK(overlays.poses_read(2) == 1);
  CHECK(overlays.poses_read(4) == 1);
  CHECK(overlays.at(1).summary().states == overlays.at(4).summary().states);
  overlays.forget();
  overlays.run(10);
  CHECK(overlays.total_sent() == 0);
}

TEST_CASE("calls take the shortest path, and another one after an outage", "[overlay]") {
  Overlays overlays({{1, 2}, {2, 3}, {3, 4}, {4, 5}, {5, 1}});
  CHECK(overlays.call(1, 3));
  CHECK(overlays.read[3].size() == 1);
  CHECK(overlays.sent[2] == 1);
  overlays.down(1, 2);  // no other robot knows it yet
  overlays.forget();
  CHECK(overlays.call(1, 3));
  CHECK(overlays.read[3].size() == 1);
  CHECK(overlays.sent[5] == 1);
  overlays.down(1, 5);
  CHECK_FALSE(overlays.call(1, 3));
}

TEST_CASE("the lowest robot id decides between several shortest paths", "[overlay]") {
  Overlays overlays({{1, 8}, {1, 3}, {8, 2}, {3, 2}});
  const KnownRobots& of_1 = overlays.at(1).robots();
  const KnownRobots& of_2 = overlays.at(2).robots();
  CHECK(of_1.next_hop(2) == RobotId{3});
  CHECK(of_2.next_hop(1) == RobotId{3});
  CHECK(of_2.next_hop(1, RobotId{3}) == RobotId{8});
  CHECK_FALSE(of_1.next_hop(77));
}

TEST_CASE("a call does not circulate for ever, whatever links robots report", "[overlay]") {
  Overlay overlay({2, 1});
  overlay.connected(robot(1), 0.0);
  overlay.connected(robot(3), 0.0);
  CHECK(receive(overlay, robot(3), introduction({9, 1})) == OverlayArrival::kNew);
  const auto report = [&](RobotId from, const std::vector<TeamPeer>& links) {
    CHECK(receive(overlay, robot(3),
                  {.stream = OverlayStream::kLinks,
                   .origin = {from, 1},
                   .content = encode_links(links)}) == OverlayArrival::kNew);
  };
  report(3, {{1, 1}, {2, 1}, {9, 1}});
  report(9, {{3, 1}});
  OverlayMessage call{.stream = OverlayStream::kSolver, .origin = {1, 1}, .to = 9};
  int forwarded = 0;
  while (receive(overlay, robot(1), call) == OverlayArrival::kNew && forwarded < 100) {
    const OverlayOutput output = overlay.take_output();
    ++forwarded;
    call = *output.packets.back().message;
  }
  CHECK(forwarded == 16);
}

TEST_CASE("invented robots take no more memory than a full team", "[overlay]") {
  Overlay overlay({1, 1});
  overlay.connected(robot(2), 0.0);
  std::size_t taken = 0, refused = 0;
  for (RobotId id = 3; id < 3000; ++id) {
    const OverlayArrival arrival = receive(overlay, robot(2), introduction({id, 1}));
    taken += arrival == OverlayArrival::kNew ? 1 : 0;
    refused += arrival == OverlayArrival::kNoRoom ? 1 : 0;
    const OverlayMessage state{.stream = kPoses, .origin = {id, 1}, .content = {7}};
    CHECK((receive(overlay, robot(2), state) == OverlayArrival::kNew) ==
          (arrival == OverlayArrival::kNew));
  }
  CHECK(taken == kMaxTeam - 1);
  CHECK(taken + refused == 2997);
  overlay.connected(robot(4000), 0.0);  // a robot with a direct link is accepted
  const OverlayMessage state{.stream = kPoses, .origin = {4000, 1}, .content = {7}};
  CHECK(receive(overlay, robot(4000), state) == OverlayArrival::kNew);
}

TEST_CASE("states that one robot sends do not use the memory for those of others", "[overlay]") {
  Overlays team({{1, 2}, {1, 3}});
  Overlay& overlay = team.at(1);
  constexpr std::size_t kLarge = SpreadStates::kMaxHeldFromOne / 3;
  const auto arrives = [&](RobotId from, RobotId origin, std::uint32_t number, std::size_t size) {
    (void)receive(overlay, robot(from), introduction({origin, 1}));
    return receive(
        overlay, robot(from),
        {.stream = kPoses, .origin = {origin, 1}, .number = number, .content = octets(size)});
  };
  CHECK(arrives(2, 100, 1, kLarge) == OverlayArrival::kNew);
  CHECK(arrives(2, 101, 1, kLarge) == OverlayArrival::kNew);
  CHECK(arrives(2, 102, 1, kLarge) == OverlayArrival::kNoRoom);
  CHECK(arrives(3, 102, 1, kLarge) == OverlayArrival::kNew);
  // A newer message replaces the old one.
  CHECK(arrives(2, 101, 2, kLarge) == OverlayArrival::kNew);
  CHECK(arrives(2, 101, 3, 1) == OverlayArrival::kNew);
  CHECK(arrives(2, 103, 1, kLarge) == OverlayArrival::kNew);
}

TEST_CASE("a link that returns at once counts as uninterrupted", "[overlay]") {
  Overlays overlays({{1, 2}, {2, 3}});
  Overlay& overlay = overlays.at(2);
  const auto version = overlay.robots().links_version();
  overlays.down(2, 3);
  overlays.now_s += 2.0;
  overlay.step(overlays.now_s);
  CHECK(overlay.robots().own_links().size() == 2);
  overlays.up(2, 3);
  overlays.now_s += 2.0;
  overlay.step(overlays.now_s);
  CHECK(overlay.robots().links_version() == version);
  overlays.down(2, 3);
  overlays.now_s += KnownRobots::kLinkPatience_s;
  overlay.step(overlays.now_s);
  CHECK(overlay.robots().own_links() == std::vector<TeamPeer>{{1, 1}});
  CHECK(overlay.robots().links().component(2) == std::set<RobotId>{1, 2});
}

TEST_CASE("after a restart of a robot only the new process counts", "[overlay]") {
  constexpr std::uint64_t kNext = std::uint64_t{1} << 32U;
  Overlays overlays({{1, 2}, {2, 3}});
  const OverlayMessage old{.stream = kPoses, .origin = {3, 1}, .number = 1000, .content = {7}};
  const OverlayMessage fresh{.stream = kPoses, .origin = {3, kNext}, .number = 1, .content = {7}};
  Overlay &one = overlays.at(1), &two = overlays.at(2);
  // No robot receives it directly yet.
  CHECK(receive(one, robot(2), introduction({3, kNext})) == OverlayArrival::kRefused);
  two.lost(3, 0.0);
  two.connected(robot(3, kNext), 0.0);
  overlays.run(1);
  CHECK(receive(two, robot(3), old) == OverlayArrival::kRefused);
  CHECK(receive(two, robot(3, kNext), fresh) == OverlayArrival::kNew);
  overlays.carry();  // robot 2 introduces the new process and forwards its state
  CHECK(one.robots().process(3) == TeamPeer{3, kNext});
  CHECK(overlays.poses_read(1) == 1);
  CHECK(receive(one, robot(2), old) == OverlayArrival::kRefused);
}

TEST_CASE("states in a team with keys are signed only for robots out of reach", "[overlay]") {
  Network network(3, true);
  network.link(kA, kB);
  network.run(2.0);
  const auto publish = [&](RobotId id) {
    network.at(id).publish(kPoses, octets(20), network.now_s());
    network.run(kPeriod_s);
  };
  std::map<RobotId, bool> is_signed;  // the last poses of each robot
  network.tamper([&](OverlayMessage& message) {
    if (message.stream == kPoses) is_signed[message.origin.robot] = message.is_signed;
  });
  publish(kA);
  CHECK(network.read(kB, kPoses).size() == 1);
  CHECK_FALSE(is_signed.at(kA));
  network.link(kB, kC);
  network.run(5.0);
  CHECK(network.read(kC, kPoses).size() == 1);  // robot A has signed its last state
  CHECK(is_signed.at(kA));
  publish(kA);
  CHECK(network.read(kC, kPoses).size() == 2);
  CHECK(network.read(kB, kPoses).size() == 2);
  publish(kB);
  CHECK(network.read(kA, kPoses).size() == 1);
  CHECK_FALSE(is_signed.at(kB));  // all robots receive it directly
  network.tamper([](OverlayMessage& message) {
    if (message.stream == kPoses) message.content.front() ^= 1U;
  });
  publish(kA);
  CHECK(network.read(kC, kPoses).size() == 3);  // two of robot A and one of robot B
  REQUIRE_FALSE(network.refusals(kB).empty());
  CHECK(network.refusals(kB).front() == "not signed by its origin, or changed on its way");
}

TEST_CASE("a robot with keys is asked for new DDS writers when its packets do not arrive",
          "[overlay]") {
  const bool has_keys = GENERATE(true, false);
  CAPTURE(has_keys);
  Network network(3, has_keys);
  network.link(kA, kB);
  network.link(kA, kC);
  network.run(3.0 * Overlay::kMissedAfter_s);
  CHECK(network.at(kB).summary().missed.empty());  // silence is no loss
  network.jam(kA, kB);
  network.run(3.0 * Overlay::kMissedAfter_s);
  CHECK(network.at(kB).summary().missed.empty());
  network.at(kA).publish(kPoses, octets(20), network.now_s());
  network.run(Overlay::kMissedAfter_s - kPeriod_s);
  CHECK(network.renewed(kA).empty());
  network.run(3.0 * kPeriod_s);
  CHECK(network.renewed(kA) == (has_keys ? std::vector<RobotId>{kB} : std::vector<RobotId>()));
  CHECK(network.renewed(kB).empty());
  CHECK(network.renewed(kC).empty());
  network.run(Overlay::kRenewEvery_s);
  CHECK(network.renewed(kA).size() == (has_keys ? 2 : 0));
  network.clear(kA, kB);
  network.run(Overlay::kMissedAfter_s);
  CHECK(network.read(kB, kPoses).size() == 1);
  CHECK(network.at(kB).summary().missed.empty());
}

TEST_CASE("packets that arrive show that the DDS writers work, whatever is missing", "[overlay]") {
  Network network(2, true);
  network.link(kA, kB);
  network.run(1.0);
  network.tamper([](OverlayMessage& message) {
    if (message.stream == kPoses) message.origin.boot = 1;  // is refused
  });
  network.at(kA).publish(kPoses, octets(20), network.now_s());
  network.run(5.0 * Overlay::kMissedAfter_s);
  CHECK(network.read(kB, kPoses).empty());
  CHECK(network.renewed(kA).empty());
}

}  // namespace km
