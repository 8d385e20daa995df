#include "runtime/overlay/overlay.hpp"
#include "test/runtime/overlay/overlay_network.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr OverlayStream kPoses = OverlayStream::kMemberPoses;
using Links = Network::Links;

RobotIdentity robot(RobotId id) {
  return {.robot = id, .name = name_of(id), .boot = 1};
}

// Robots 1 to `count` in a line.
Network::Links line(RobotId count) {
  Network::Links links;
  for (RobotId id = 1; id < count; ++id) links.emplace_back(id, static_cast<RobotId>(id + 1));
  return links;
}

OverlayArrival receive(Overlay& overlay, const RobotIdentity& from, OverlayMessage message) {
  return overlay.receive(from, std::make_shared<const OverlayMessage>(std::move(message)), 0.0);
}

OverlayMessage introduction(TeamPeer origin) {
  return {.origin = origin, .content = {'r'}};
}

}  // namespace

TEST_CASE("all robots receive each state once, over any links") {
  const Links links = GENERATE(line(6), Links{{1, 6}, {2, 6}, {3, 6}, {4, 6}, {5, 6}},
                               Links{{1, 2}, {2, 3}, {3, 4}, {4, 5}, {5, 6}, {1, 6}},
                               Links{{1, 2}, {1, 3}, {2, 3}, {3, 4}, {4, 5}, {4, 6}, {5, 6}});
  Network network(7, links);
  for (const RobotId id : {RobotId{1}, RobotId{3}, RobotId{6}}) network.publish(id, kPoses);
  for (RobotId id = 1; id <= 6; ++id) {
    CAPTURE(id);
    const std::size_t own = id == 1 || id == 3 || id == 6 ? 1 : 0;
    CHECK(network.read(id, kPoses).size() == 3 - own);
  }
}

TEST_CASE("robots that meet one after the other forward nothing") {
  constexpr RobotId kRobots = 16;
  Links links;
  for (RobotId a = 0; a < kRobots; ++a)
    for (RobotId b = 0; b < a; ++b) links.emplace_back(b, a);
  std::mt19937 random(GENERATE(1U, 2U, 3U));
  std::ranges::shuffle(links, random);
  Network network(kRobots);
  std::size_t reports = 0;
  network.tamper([&](const OverlayMessage&) { ++reports; });
  for (const auto& [a, b] : links) {
    network.link(a, b);
    network.wait(0.9 / static_cast<double>(links.size()));
  }
  network.run(3.0);
  CHECK(network.packets() == 0);
  CHECK(reports <= kRobots * (kRobots - 1) * 3);
  for (RobotId id = 0; id < kRobots; ++id)
    CHECK(network.at(id).robots().links().component(id).size() == kRobots);
}

TEST_CASE("the states of a full team reach all robots of a line") {
  Network network(kMaxTeam + 1);
  network.link(line(kMaxTeam));
  network.run(100.0);
  network.forget();
  network.publish(1, kPoses);
  CHECK(network.read(kMaxTeam, kPoses).size() == 1);
  CHECK(network.packets() == kMaxTeam - 1);
}

TEST_CASE("a lost state is sent again when the hashes show its loss") {
  Network network(5, line(4));
  network.lose(1.0);
  network.publish(1, kPoses);
  network.lose(0.0);
  network.forget();
  network.run(12.0);
  CHECK(network.read(2, kPoses).size() == 1);
  CHECK(network.read(4, kPoses).size() == 1);
  CHECK(network.at(1).summary().states == network.at(4).summary().states);
  network.forget();
  network.run(5.0);
  CHECK(network.packets() == 0);
}

TEST_CASE("calls take the shortest path, and another one after an outage") {
  Network network(6, {{1, 2}, {2, 3}, {3, 4}, {4, 5}, {5, 1}});
  const auto hops_to_3 = [&] {
    network.forget();
    REQUIRE(network.call(1, OverlayStream::kSolver, 3));
    REQUIRE(network.read(3, OverlayStream::kSolver).size() == 1);
    return network.all_read(3).front()->hops;
  };
  CHECK(hops_to_3() == 1);
  network.cut(1, 2);
  CHECK(hops_to_3() == 2);
  network.cut(5, 1);
  CHECK_FALSE(network.call(1, OverlayStream::kSolver, 3));
}

TEST_CASE("a call does not circulate for ever, whatever links robots report") {
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

TEST_CASE("invented robots take no more memory than a full team") {
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

TEST_CASE("states that one robot sends do not use the memory for those of others") {
  Network team(4, {{1, 2}, {1, 3}});
  Overlay& overlay = team.at(1);
  constexpr std::size_t kLarge = SpreadStates::kMaxHeldFromOne / 3;
  const auto arrives = [&](RobotId from, RobotId origin, std::uint32_t number, std::size_t size) {
    (void)receive(overlay, team.identity(from), introduction({origin, 1}));
    return receive(
        overlay, team.identity(from),
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

TEST_CASE("a link that returns at once counts as uninterrupted") {
  Network network(4, line(3));
  const Overlay& overlay = network.at(2);
  const auto version = overlay.robots().links_version();
  network.cut(2, 3);
  network.wait(2.0);
  CHECK(overlay.robots().own_links().size() == 2);
  network.link(2, 3);
  network.wait(2.0);
  CHECK(overlay.robots().links_version() == version);
  network.cut(2, 3);
  network.wait(KnownRobots::kLinkPatience_s);
  CHECK(overlay.robots().own_links() == std::vector<TeamPeer>{{1, Network::first_boot(1)}});
  CHECK(overlay.robots().links().component(2) == std::set<RobotId>{1, 2});
}

TEST_CASE("after a restart of a robot only the new process counts") {
  constexpr std::uint64_t kNext = std::uint64_t{99} << 32U;
  Network network(4, line(3));
  const RobotIdentity former = network.identity(3), two_itself = network.identity(2);
  RobotIdentity next = former;
  next.boot = kNext;
  const OverlayMessage old{
      .stream = kPoses, .origin = {3, former.boot}, .number = 1000, .content = {7}};
  const OverlayMessage fresh{.stream = kPoses, .origin = {3, kNext}, .number = 1, .content = {7}};
  Overlay &one = network.at(1), &two = network.at(2);
  // No robot receives it directly yet.
  CHECK(receive(one, two_itself, introduction({3, kNext})) == OverlayArrival::kRefused);
  two.lost(3, 0.0);
  two.connected(next, 0.0);
  network.wait(0.0);  // robot 2 reports the link
  network.run(kPeriod_s);
  CHECK(receive(two, next, old) == OverlayArrival::kRefused);
  CHECK(receive(two, next, fresh) == OverlayArrival::kNew);
  network.wait(0.0);  // robot 2 introduces the new process and forwards its state
  CHECK(one.robots().process(3) == TeamPeer{3, kNext});
  CHECK(network.read(1, kPoses).size() == 1);
  CHECK(receive(one, two_itself, old) == OverlayArrival::kRefused);
}

TEST_CASE("states in a team with keys are signed only for robots out of reach") {
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

TEST_CASE("a robot with keys is asked for new DDS writers when its packets do not arrive") {
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

TEST_CASE("packets that arrive show that the DDS writers work, whatever is missing") {
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
