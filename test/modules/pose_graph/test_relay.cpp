#include <catch2/catch.hpp>
#include <deque>

#include "modules/pose_graph/relay.hpp"

namespace km {
namespace {

// Relays whose messages arrive at once; the class records the messages that are new to a robot.
struct Relays {
  std::map<RobotId, Relay> of = {};
  std::set<std::pair<RobotId, RobotId>> links = {};
  std::map<RobotId, std::vector<TeamMessagePtr>> read = {};
  std::map<RobotId, int> sent = {};
  bool losing = false;
  double now_s = 0.0;

  explicit Relays(const std::vector<std::pair<RobotId, RobotId>>& pairs) {
    for (const auto& [a, b] : pairs) up(a, b);
    for (int k = 0; k < 10; ++k) send_statuses();
  }
  Relay& at(RobotId robot) { return of.try_emplace(robot, TeamPeer{robot, 1}, 1.0).first->second; }
  void up(RobotId a, RobotId b) {
    links.insert({{a, b}, {b, a}});
    at(a).link_up({b, 1}, now_s);
    at(b).link_up({a, 1}, now_s);
  }
  void down(RobotId a, RobotId b) {
    links.erase({a, b});
    links.erase({b, a});
    at(a).link_down(b, now_s);
    at(b).link_down(a, now_s);
  }
  // All robots send statuses, after a possible change of links.
  void send_statuses() {
    for (auto& [robot, relay] : of) {
      relay.step(now_s);
      (void)relay.publish(TeamStatus{.sender = {robot, 1}, .frame = {robot, 1}}, now_s);
    }
    carry();
  }
  void repeat_all() {
    for (auto& [robot, relay] : of) relay.repeat_status(now_s);
    carry();
  }
  void carry() {
    std::deque<std::pair<RobotId, LinkPacket>> on_the_way;
    const auto collect = [&] {
      for (auto& [robot, relay] : of)
        for (LinkPacket& packet : relay.take_packets()) {
          ++sent[robot];
          on_the_way.emplace_back(robot, std::move(packet));
        }
    };
    for (collect(); !on_the_way.empty(); collect()) {
      const auto [from, packet] = on_the_way.front();
      on_the_way.pop_front();
      if (!links.contains({from, packet.next}) || losing) continue;
      if (at(packet.next).receive(from, packet.message, now_s) == Arrival::kNew)
        read[packet.next].push_back(packet.message);
    }
  }
  void forget() {
    read.clear();
    sent.clear();
  }
  std::size_t poses_read(RobotId robot) {
    std::size_t count = 0;
    for (const auto& message : read[robot])
      count += std::holds_alternative<MemberPoses>(*message) ? 1 : 0;
    return count;
  }
  int total_sent() {
    int total = 0;
    for (const auto& [robot, count] : sent) total += count;
    return total;
  }
};

using Pairs = std::vector<std::pair<RobotId, RobotId>>;

ReliableMessage reliable(RobotId from, RobotId to) {
  return {
      .sender = {from, 1}, .to = to, .bytes = std::make_shared<const std::vector<std::uint8_t>>(3)};
}

}  // namespace

TEST_CASE("all robots receive each message once, over any links", "[pose_graph][relay]") {
  const Pairs pairs = GENERATE(Pairs{{1, 2}, {2, 3}, {3, 4}, {4, 5}, {5, 6}},
                               Pairs{{1, 6}, {2, 6}, {3, 6}, {4, 6}, {5, 6}},
                               Pairs{{1, 2}, {2, 3}, {3, 4}, {4, 5}, {5, 6}, {1, 6}},
                               Pairs{{1, 2}, {1, 3}, {2, 3}, {3, 4}, {4, 5}, {4, 6}, {5, 6}});
  Relays relays(pairs);
  relays.forget();
  for (const RobotId robot : {RobotId{1}, RobotId{3}, RobotId{6}})
    (void)relays.at(robot).publish(MemberPoses{.sender = {robot, 1}}, 0.0);
  relays.carry();
  for (const auto& [robot, relay] : relays.of) {
    CAPTURE(robot);
    const std::size_t own = robot == 1 || robot == 3 || robot == 6 ? 1 : 0;
    CHECK(relays.poses_read(robot) == 3 - own);
  }
}

TEST_CASE("nothing is forwarded if all robots receive each other", "[pose_graph][relay]") {
  Pairs pairs;
  for (RobotId a = 1; a <= 6; ++a)
    for (RobotId b = 1; b < a; ++b) pairs.emplace_back(a, b);
  Relays relays(pairs);
  relays.forget();
  CHECK(relays.at(2).publish(MemberPoses{.sender = {2, 1}}, 0.0) == 5);
  relays.carry();
  CHECK(relays.total_sent() == 5);
  for (const RobotId robot : std::vector<RobotId>{1, 3, 4, 5, 6})
    CHECK(relays.poses_read(robot) == 1);
}

TEST_CASE("in a line of robots, each message passes each link once", "[pose_graph][relay]") {
  Relays relays({{1, 2}, {2, 3}, {3, 4}, {4, 5}});
  relays.forget();
  (void)relays.at(3).publish(MemberPoses{.sender = {3, 1}}, 0.0);
  relays.carry();
  CHECK(relays.total_sent() == 4);
}

TEST_CASE("a robot with a new link receives all present messages", "[pose_graph][relay]") {
  Relays relays({{1, 2}, {2, 3}});
  (void)relays.at(1).publish(MemberPoses{.sender = {1, 1}}, 0.0);
  (void)relays.at(3).publish(MemberPoses{.sender = {3, 1}}, 0.0);
  relays.carry();
  relays.up(3, 4);
  relays.carry();
  CHECK(relays.poses_read(4) == 2);
}

TEST_CASE("a lost message is forwarded when the hashes show its loss", "[pose_graph][relay]") {
  Relays relays({{1, 2}, {2, 3}, {3, 4}});
  relays.losing = true;
  (void)relays.at(1).publish(MemberPoses{.sender = {1, 1}}, 0.0);
  relays.carry();
  relays.losing = false;
  relays.forget();
  for (int k = 0; k < 12; ++k) {
    relays.now_s += 1.0;
    relays.repeat_all();
  }
  CHECK(relays.poses_read(2) == 1);
  CHECK(relays.poses_read(4) == 1);
  CHECK(relays.at(1).holds() == relays.at(4).holds());
  relays.forget();
  relays.now_s += 1.0;
  relays.repeat_all();
  CHECK(relays.total_sent() == 6);  // only the statuses, to all direct receivers
}

TEST_CASE("reliable messages take the shortest path, and another one after an outage",
          "[pose_graph][relay]") {
  Relays relays({{1, 2}, {2, 3}, {3, 4}, {4, 5}, {5, 1}});
  relays.forget();
  CHECK(relays.at(1).publish(reliable(1, 3), 0.0) == 1);
  relays.carry();
  CHECK(relays.read[3].size() == 1);
  CHECK(relays.sent[2] == 1);
  relays.down(1, 2);  // no other robot knows it yet
  relays.forget();
  CHECK(relays.at(1).publish(reliable(1, 3), 0.0) == 1);
  relays.carry();
  CHECK(relays.read[3].size() == 1);
  CHECK(relays.sent[5] == 1);
  relays.down(1, 5);
  CHECK(relays.at(1).publish(reliable(1, 3), 0.0) == 0);
}

TEST_CASE("the lowest robot id decides between several shortest paths", "[pose_graph][relay]") {
  Relays relays({{1, 8}, {1, 3}, {8, 2}, {3, 2}});
  CHECK(relays.at(1).next_hop(2) == RobotId{3});
  CHECK(relays.at(2).next_hop(1) == RobotId{3});
  CHECK(relays.at(1).next_hop(2, RobotId{3}) == RobotId{8});
  CHECK_FALSE(relays.at(1).next_hop(77));
}

TEST_CASE("a reliable message does not circulate, whatever links robots report",
          "[pose_graph][relay]") {
  Relay relay({2, 1}, 1.0);
  relay.link_up({1, 1}, 0.0);
  relay.link_up({3, 1}, 0.0);
  TeamStatus lie{.sender = {3, 1}, .frame = {3, 1}};
  lie.number = 1;
  lie.receives = {{1, 1}, {2, 1}, {9, 1}};
  CHECK(relay.receive(3, std::make_shared<const TeamMessage>(lie), 0.0) == Arrival::kNew);
  lie.sender = {9, 1};
  lie.receives = {{3, 1}};
  CHECK(relay.receive(3, std::make_shared<const TeamMessage>(lie), 0.0) == Arrival::kNew);
  const auto message = std::make_shared<const TeamMessage>(reliable(1, 9));
  CHECK(relay.receive(1, message, 0.0) == Arrival::kPassedOn);
  CHECK(relay.receive(3, message, 0.0) == Arrival::kLost);
  CHECK(relay.receive(1, message, 0.0) == Arrival::kLost);  // a repetition
  ReliableMessage again = reliable(1, 9);
  again.copy = 1;
  CHECK(relay.receive(1, std::make_shared<const TeamMessage>(again), 0.0) == Arrival::kPassedOn);
}

TEST_CASE("invented robots take no more memory than a full team", "[pose_graph][relay]") {
  Relay relay({1, 1}, 1.0);
  relay.link_up({2, 1}, 0.0);
  std::size_t taken = 0, refused = 0;
  for (RobotId robot = 3; robot < 3000; ++robot) {
    const TeamStatus status{.sender = {robot, 1}, .number = 1, .frame = {robot, 1}};
    const Arrival arrival = relay.receive(2, std::make_shared<const TeamMessage>(status), 0.0);
    taken += arrival == Arrival::kNew ? 1 : 0;
    refused += arrival == Arrival::kRefused ? 1 : 0;
  }
  CHECK(taken < 1024);
  CHECK(refused > 1900);
  relay.link_up({4000, 1}, 0.0);  // a robot with a direct link is accepted
  const TeamStatus status{.sender = {4000, 1}, .number = 1, .frame = {4000, 1}};
  CHECK(relay.receive(4000, std::make_shared<const TeamMessage>(status), 0.0) == Arrival::kNew);
}

TEST_CASE("messages forwarded by one robot do not use the memory for those of others",
          "[pose_graph][relay]") {
  Relays team({{1, 2}, {1, 3}});
  Relay& relay = team.at(1);
  const auto poses_of = [](TeamPeer sender, std::uint32_t number, std::size_t size) {
    MemberPoses poses{.sender = sender, .number = number};
    poses.keyframes.resize(size);
    return std::make_shared<const TeamMessage>(std::move(poses));
  };
  constexpr std::size_t kLarge = Relay::kMaxHeldFromOne / sizeof(KeyframeIndex) / 3;
  CHECK(relay.receive(2, poses_of({100, 1}, 1, kLarge), 0.0) == Arrival::kNew);
  CHECK(relay.receive(2, poses_of({101, 1}, 1, kLarge), 0.0) == Arrival::kNew);
  CHECK(relay.receive(2, poses_of({102, 1}, 1, kLarge), 0.0) == Arrival::kNoRoom);
  CHECK(relay.receive(3, poses_of({102, 1}, 1, kLarge), 0.0) == Arrival::kNew);
  // A newer message replaces the old one.
  CHECK(relay.receive(2, poses_of({101, 1}, 2, kLarge), 0.0) == Arrival::kNew);
  CHECK(relay.receive(2, poses_of({101, 1}, 3, 1), 0.0) == Arrival::kNew);
  CHECK(relay.receive(2, poses_of({103, 1}, 1, kLarge), 0.0) == Arrival::kNew);
}

TEST_CASE("a link that returns at once counts as uninterrupted", "[pose_graph][relay]") {
  Relays relays({{1, 2}, {2, 3}});
  const auto version = relays.at(2).links_version();
  relays.down(2, 3);
  relays.now_s += 2.0;
  relays.at(2).step(relays.now_s);
  CHECK(relays.at(2).receives().size() == 2);
  relays.up(2, 3);
  relays.now_s += 2.0;
  relays.at(2).step(relays.now_s);
  CHECK(relays.at(2).links_version() == version);
  relays.down(2, 3);
  relays.now_s += Relay::kPatience_s;
  relays.at(2).step(relays.now_s);
  CHECK(relays.at(2).receives() == std::vector<TeamPeer>{{1, 1}});
  CHECK(relays.at(2).links().component(2) == std::set<RobotId>{1, 2});
}

TEST_CASE("after a restart of a robot only the new process counts", "[pose_graph][relay]") {
  Relays relays({{1, 2}, {2, 3}});
  const TeamStatus old{.sender = {3, 1}, .number = 1000, .frame = {3, 1}};
  const TeamStatus fresh{.sender = {3, 2}, .number = 1, .frame = {3, 2}};
  const auto receive = [&](RobotId at, RobotId from, const TeamStatus& status) {
    return relays.at(at).receive(from, std::make_shared<const TeamMessage>(status), 0.0);
  };
  CHECK(receive(1, 2, fresh) == Arrival::kRefused);  // no robot receives it directly yet
  relays.at(2).link_down(3, 0.0);
  relays.at(2).link_up({3, 2}, 0.0);
  relays.send_statuses();
  CHECK(receive(2, 3, old) == Arrival::kRefused);
  CHECK(receive(2, 3, fresh) == Arrival::kNew);
  CHECK(receive(1, 2, fresh) == Arrival::kNew);
  CHECK(receive(1, 2, old) == Arrival::kRefused);
}

}  // namespace km
