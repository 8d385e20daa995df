#include "modules/loop_closure/node/loop_closure_codec.hpp"
#include "modules/outlier_rejection/node/outlier_rejection_codec.hpp"
#include "modules/place_recognition/node/place_recognition_codec.hpp"
#include "runtime/clock.hpp"
#include "runtime/dds/participant.hpp"
#include "runtime/overlay/overlay_node.hpp"
#include "test/modules/security/toy_team.hpp"
#include "test/runtime/dds/dds_fixture.hpp"
#include "test/support/inbox.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

TeamPeer process_of(RobotId robot) {
  return {robot, (std::uint64_t{robot} + 1) << kResumeBits};
}

RobotIdentity identity_of(RobotId robot) {
  return {.robot = robot, .name = robot_name(robot), .boot = process_of(robot).boot};
}

std::int64_t today_s() {
  return static_cast<std::int64_t>(wall_now_s());
}

std::unique_ptr<SharedSeal> seal_of(const ToyTeam& team, RobotId robot) {
  return std::make_unique<SharedSeal>(team.keys_of(robot, robot_name(robot), today_s() - 3600),
                                      identity_of(robot), today_s());
}

// Passes messages from topic to topic in place of DDS.
struct Relaying {
  Relaying(const std::shared_ptr<const DdsDomain>& domain, RobotId robot, double& now_s,
           std::unique_ptr<SharedSeal> keys)
      : self(robot),
        participant(domain, identity_of(robot)),
        peers(participant),
        seal(std::move(keys)),
        node(process_of(robot), seal.get(), peers,
             {events, statuses, team_packets, places_packets, reached, links},
             [&now_s] { return now_s; }),
        bow_guard(node.guard<KeyframeBow>(
            OverlayStream::kBag, [](const KeyframeBow& bow) { return std::optional(bow.id); })) {
    node.join<KeyframeBow>(OverlayStream::kBag, received_bows, bows);
    node.join_calls(
        OverlayStream::kRequest,
        RelayedTopics<KeyframeRequest>{own_requests, direct_requests, received_requests, requests},
        [](const KeyframeRequest& request) { return std::optional(request.keyframe); });
    node.join_reliable(OverlayStream::kInlierSet,
                       RelayedTopics<InlierSet>{own_sets, direct_sets, received_sets, sets});
  }

  // Sends and receives a message to all robots as the bridge does.
  [[nodiscard]] Octets content_of(const KeyframeBow& bow) const {
    const auto encoded = Codec<KeyframeBow>::encode(bow);
    Octets content = serialize(Codec<KeyframeBow>::descriptor(), &encoded.wire);
    if (bow_guard.tail_bytes == 0) return content;
    const Octets tail = bow_guard.tail(bow, content);
    content.insert(content.end(), tail.begin(), tail.end());
    return content;
  }
  [[nodiscard]] std::string receive(const TeamPeer& sender, const Octets& content) {
    return reason_of(
        detail::publish_decoded<KeyframeBow>(received_bows, sender, content, nullptr, bow_guard));
  }

  RobotId self;
  DdsParticipant participant;
  Peers peers;
  std::unique_ptr<SharedSeal> seal;
  Topic<PeerEvent> events, reached;
  Topic<RobotStatus> statuses;
  Topic<Addressed<TeamLanePacket>> team_packets;
  Topic<Addressed<PlacesLanePacket>> places_packets;
  Topic<LinksReport> links;
  Topic<KeyframeBow> received_bows, bows;
  Topic<Addressed<KeyframeRequest>> own_requests, direct_requests;
  Topic<KeyframeRequest> received_requests, requests;
  Topic<Addressed<InlierSet>> own_sets, direct_sets;
  Topic<InlierSet> received_sets, sets;
  Inbox<KeyframeBow> got_bows{bows};
  Inbox<KeyframeRequest> got_requests{requests};
  Inbox<InlierSet> got_sets{sets};
  Inbox<PeerEvent> got_ways{reached};
  Inbox<Addressed<KeyframeRequest>> sent_directly{direct_requests};
  Inbox<Addressed<InlierSet>> sets_sent_directly{direct_sets};
  OverlayNode node;
  ContentGuard<KeyframeBow> bow_guard;
};

// Robots 0 and 1 do not receive each other directly; robot 2 receives both.
struct Chain {
  explicit Chain(bool has_keys) {
    for (RobotId robot = 0; robot < 3; ++robot)
      robots.push_back(std::make_unique<Relaying>(domain, robot, now_s,
                                                  has_keys ? seal_of(team, robot) : nullptr));
    for (auto& robot : robots) {
      const auto pass = [this, from = robot->self](const auto& packet) {
        carry(from, packet->to, *packet->message);
      };
      robot->team_packets.subscribe(pass);
      robot->places_packets.subscribe(pass);
    }
    for (const RobotId end : {RobotId{0}, RobotId{1}}) {
      if (has_keys) {
        admit(end, 2);
        admit(2, end);
      }
      robots[end]->events.publish(PeerEvent{PeerEventKind::kJoined, identity_of(2), {}});
      robots[2]->events.publish(PeerEvent{PeerEventKind::kJoined, identity_of(end), {}});
    }
  }
  template <OverlayLane kLane>
  void carry(RobotId from, RobotId to, const LanePacket<kLane>& packet) {
    const LanePacket<kLane> arrived{{from, packet.message, packet.is_own}};
    if (const char* why =
            robots[to]->node.template guard_packets<kLane>().check(process_of(from), arrived, {}))
      refusals.emplace_back(why);
  }
  void admit(RobotId to, RobotId from) {
    const char* why = robots[to]->seal->with([&](TeamSeal& seal) {
      return seal.admit(identity_of(from), robots[from]->seal->credentials(), today_s());
    });
    REQUIRE(why == nullptr);
  }
  // Exchanges statuses for a while.
  void run(double seconds) {
    for (const double end_s = now_s + seconds; now_s < end_s; now_s += kStatusPeriod_s) {
      for (auto& robot : robots) robot->node.step();
      for (const RobotId end : {RobotId{0}, RobotId{1}}) {
        send_status(end, 2);
        send_status(2, end);
      }
    }
  }
  void send_status(RobotId from, RobotId to) {
    robots[to]->statuses.publish(RobotStatus{
        .robot = from, .name = robot_name(from), .overlay = robots[from]->node.summary()});
  }

  double now_s = 0.0;
  ToyTeam team;
  std::vector<std::string> refusals;
  std::shared_ptr<const DdsDomain> domain = std::make_shared<DdsDomain>(loopback_config());
  std::vector<std::unique_ptr<Relaying>> robots;
};

}  // namespace

TEST_CASE("Relayed messages arrive on the topics of directly received ones") {
  const bool has_keys = GENERATE(false, true);
  CAPTURE(has_keys);
  Chain chain(has_keys);
  Relaying &a = *chain.robots[0], &b = *chain.robots[1], &c = *chain.robots[2];
  c.peers.tell(&PeerTable::reported,
               identity_of(0));  // Stands for the discovery of robot 0 by DDS.
  const Octets bow = a.content_of({.id = {0, 0}, .words = {{3, 1}}});
  REQUIRE(c.receive(process_of(0), bow).empty());
  chain.run(20.0);
  REQUIRE(c.got_bows.messages().size() == 1);
  REQUIRE(b.got_bows.messages().size() == 1);
  CHECK(b.got_bows.messages()[0].id == KeyframeId{0, 0});
  CHECK(b.got_bows.messages()[0].words == BagOfWords{{3, 1}});
  CHECK(b.peers.ask(&PeerTable::current, RobotId{0}) == process_of(0));
  REQUIRE(b.got_ways.messages().size() == 1);
  CHECK(b.got_ways.messages()[0].identity.robot == 0);
  CHECK_FALSE(b.got_ways.messages()[0].direct);

  const KeyframeRequest request{.requester = 1, .number = 4, .keyframe = {0, 0}, .own = 9};
  b.own_requests.publish(
      Addressed<KeyframeRequest>{0, std::make_shared<const KeyframeRequest>(request)});
  REQUIRE(a.got_requests.messages().size() == 1);
  CHECK(a.got_requests.messages()[0].requester == 1);
  CHECK(a.got_requests.messages()[0].own == 9);
  CHECK(b.sent_directly.messages().empty());
  b.own_requests.publish(
      Addressed<KeyframeRequest>{2, std::make_shared<const KeyframeRequest>(request)});
  CHECK(b.sent_directly.messages().size() == 1);
  b.events.publish(PeerEvent{PeerEventKind::kLost, identity_of(2), {}});
  b.own_requests.publish(
      Addressed<KeyframeRequest>{2, std::make_shared<const KeyframeRequest>(request)});
  CHECK(b.sent_directly.messages().size() == 2);  // Messages that DDS keeps.
  b.events.publish(PeerEvent{PeerEventKind::kReturned, identity_of(2), {}});

  const InlierSet set{.a = 0, .b = 1, .version = 1, .closures = {{{0, 1}, {1, 2}}}};
  a.own_sets.publish(Addressed<InlierSet>{1, std::make_shared<const InlierSet>(set)});
  chain.run(2.0);
  REQUIRE(b.got_sets.messages().size() == 1);
  CHECK(b.got_sets.messages()[0].closures == set.closures);
  CHECK(a.sets_sent_directly.messages().size() == 1);
  CHECK(chain.refusals.empty());
}

}  // namespace km
