#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "modules/loop_closure/node/loop_closure_codec.hpp"
#include "modules/mesh/node/mesh_codec.hpp"
#include "modules/outlier_rejection/node/outlier_rejection_codec.hpp"
#include "modules/place_recognition/node/place_recognition_codec.hpp"
#include "modules/session/node/team_codec.hpp"
#include "runtime/overlay/endorsement.hpp"
#include "test/runtime/dds/dds_fixture.hpp"

namespace km {

/// The counterpart of all topics of a robot (Robot::add_network), with no modules behind it.
struct FloodPeer {
  /// If `make_seal` is empty, messages are not encrypted.
  FloodPeer(const std::shared_ptr<const DdsDomain>& domain, const RobotIdentity& identity,
            const TestRobot::MakeSeal& make_seal)
      : participant(domain, identity, make_seal ? make_seal(identity) : nullptr),
        bridge(participant),
        status_node(
            [identity] { return RobotStatus{.robot = identity.robot, .name = identity.name}; },
            {.own = statuses.to_peers(), .peers = statuses.from_peers()}),
        peer_events(bridge.peers().events()) {
    using enum TopicKind;
    const bool has_keys = participant.seal() != nullptr;
    constexpr auto kOther = TrafficCategory::kOther;
    constexpr CrossingEnds kSends{.receive = false};
    bridge.exchange(statuses, kStatus, kOther);
    bridge.exchange(bows, kEvent, kOther, kSends, {}, unsigned_guard<KeyframeBow>(has_keys));
    bridge.exchange(requests, kRequest, kOther, kSends);
    bridge.exchange(replies, kRequest, kOther, {}, {}, unsigned_guard<KeyframeReply>(has_keys));
    bridge.exchange(closures, kEvent, kOther, kSends);
    bridge.exchange(inlier_sets, kState, kOther, kSends);
    bridge.exchange(packets, kRequest, kOther);
    bridge.exchange(chunks, kState, kOther, kSends);
  }
  ~FloodPeer() {
    status_node.stop();
    bridge.stop();
  }

  /// Subscribe before.
  void start() {
    bridge.start();
    status_node.start();
  }
  [[nodiscard]] TeamPeer self() const {
    return {participant.identity().robot, participant.identity().boot};
  }
  [[nodiscard]] bool receives(RobotId robot) {
    return !peer_events
                .wait_until([&](const auto& events) {
                  return TestRobot::matching(events, PeerEventKind::kJoined, robot) > 0;
                })
                .empty();
  }
  /// Sends a message of the overlay to `to`, signed if it is of this robot and the team has keys.
  void send(RobotId to, OverlayMessage message) {
    const bool is_own = message.origin == self();
    SharedSeal* seal = participant.seal();
    if (is_own && seal != nullptr) {
      OverlayKeys keys;
      keys.endorse = [seal](OctetView statement) {
        return seal->with([&](const TeamSeal& team) { return team.endorse(statement); });
      };
      endorse(message, keys);
    }
    packets.to_peers().publish(
        {to, std::make_shared<const TeamLanePacket>(TeamLanePacket{
                 {to, std::make_shared<const OverlayMessage>(std::move(message)), is_own}})});
  }
  [[nodiscard]] TrafficCount sent() const {
    TrafficCount sum;
    for (const TopicTraffic& t : bridge.traffic().topics)
      if (t.direction == Direction::kOut) {
        sum.messages += t.count.messages;
        sum.bytes += t.count.bytes;
      }
    return sum;
  }
  [[nodiscard]] std::uint64_t bytes_from(RobotId robot) const {
    std::uint64_t sum = 0;
    for (const PeerTraffic& t : bridge.traffic().peers)
      if (t.direction == Direction::kIn && t.peer == robot) sum += t.count.bytes;
    return sum;
  }

  // Room for the signature behind messages if the team has keys, without a signature in it.
  template <typename T>
  static ContentGuard<T> unsigned_guard(bool has_keys) {
    if (!has_keys) return {};
    return {.tail_bytes = kEndorsementBytes,
            .tail = [](const T&, auto) { return std::vector<std::uint8_t>(kEndorsementBytes); }};
  }

  DdsParticipant participant;
  Crossing<KeyframeBow> bows;
  AddressedCrossing<KeyframeRequest> requests;
  AddressedCrossing<KeyframeReply> replies;
  AddressedCrossing<Closure> closures;
  AddressedCrossing<InlierSet> inlier_sets;
  AddressedCrossing<TeamLanePacket> packets;
  Crossing<MeshChunk> chunks;
  Crossing<RobotStatus> statuses;
  DdsBridge bridge;
  RobotStatusNode status_node;
  Inbox<PeerEvent> peer_events;
};

}  // namespace km
