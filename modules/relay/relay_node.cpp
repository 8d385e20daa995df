#include "modules/relay/relay_node.hpp"

#include <exception>
#include <string>
#include <utility>

#include "runtime/log.hpp"

namespace km {
namespace {

constexpr const char* kTag = "relay";

std::int64_t today_s() {
  return static_cast<std::int64_t>(wall_now_s());
}

std::optional<RelayKeys> keys_of(SharedSeal* seal) {
  if (seal == nullptr) return std::nullopt;
  return RelayKeys{
      .endorse =
          [seal](OctetView statement) {
            return seal->with([&](const TeamSeal& team) { return team.endorse(statement); });
          },
      .credentials_of =
          [seal](const TeamPeer& peer) {
            return seal->with([&](const TeamSeal& team) { return team.credentials_of(peer); });
          },
      .certified =
          [seal](const RobotIdentity& identity, const std::string& credentials) {
            return seal->with([&](const TeamSeal& team) {
              return team.certified(identity, credentials, today_s());
            });
          },
      .why_lapsed =
          [seal](const Certificate& certificate) {
            return seal->with(
                [&](const TeamSeal& team) { return team.why_lapsed(certificate, today_s()); });
          }};
}

}  // namespace

RelayNode::RelayNode(TeamPeer self, SharedSeal* seal, Peers& peers, const RelayTopics& topics,
                     std::function<double()> now_s)
    : self_(self),
      keys_(keys_of(seal)),
      peers_(peers),
      topics_(topics),
      now_s_(std::move(now_s)),
      store_(self, keys_) {
  topics.peer_events.subscribe([this](const auto& event) { take(*event); });
  topics.statuses.subscribe([this](const auto& status) {
    act([&](RelayStore& store) { store.update(status->robot, status->relay, now_s_()); });
  });
}

void RelayNode::take(const PeerEvent& event) {
  if (!event.direct) return;
  act([&](RelayStore& store) {
    switch (event.kind) {
      case PeerEventKind::kJoined:
      case PeerEventKind::kReturned:
      case PeerEventKind::kResumed:
      case PeerEventKind::kRestarted:
        return store.connected(event.identity);
      case PeerEventKind::kLost:
      case PeerEventKind::kLeft:
        return store.lost(event.identity.robot, now_s_());
      case PeerEventKind::kReported:
      case PeerEventKind::kRefused:
      case PeerEventKind::kConflict:
        return;
    }
  });
}

ContentGuard<RelayPacket> RelayNode::guard_packets() {
  return {.check = [this](const TeamPeer& /*sender*/, const RelayPacket& packet, auto /*content*/) {
    return take(packet);
  }};
}

// Returns the reason if the message is forged, otherwise null. A message that this robot does not
// expect, because it has missed an earlier one, is not forged.
const char* RelayNode::take(const RelayPacket& packet) {
  RelayArrival arrival = RelayArrival::kNew;
  const char* forged = nullptr;
  act([&](RelayStore& store) {
    arrival = store.receive(packet);
    if (arrival == RelayArrival::kForged) forged = store.refusal();
  });
  if (arrival == RelayArrival::kRefused)
    log::limited(log::Level::kDebug, kTag, "refused " + std::to_string(packet.neighbour))
        << "robot " << packet.neighbour << " forwards a message of robot "
        << packet.message->origin.robot << " that is not taken";
  return forged;
}

// Stores a directly received message for other robots. Returns the reason if it is forged,
// otherwise null.
const char* RelayNode::keep(RelayKind kind, const TeamPeer& sender, std::uint32_t number,
                            std::span<const std::uint8_t> content) {
  const char* forged = nullptr;
  const auto note = [&](const RelayStore& store, RelayArrival arrival) {
    if (arrival == RelayArrival::kForged) forged = store.refusal();
  };
  std::vector<std::uint8_t> octets(content.begin(), content.end());
  if (kind == RelayKind::kReply) {
    act([&](RelayStore& store) {
      note(store, store.keep_reply(sender, number, std::move(octets)));
    });
  } else if (const auto origin = identity_of(sender)) {
    // A message may arrive before the PeerEvent of its sender.
    act([&](RelayStore& store) {
      note(store, store.keep_bag(*origin, number, std::move(octets)));
    });
  }
  return forged;
}

std::vector<std::uint8_t> RelayNode::signature_of(RelayKind kind, std::uint32_t number,
                                                  std::span<const std::uint8_t> content) const {
  const Signature signature = endorsement_of({.kind = kind,
                                              .origin = self_,
                                              .number = number,
                                              .content = {content.begin(), content.end()}},
                                             *keys_);
  return {signature.begin(), signature.end()};
}

void RelayNode::carry_out(const RelayOutput& output, std::uint64_t given_up) {
  for (const RobotIdentity& robot : output.met) peers_.reported(robot);
  for (const RelayPacket& packet : output.packets)
    topics_.own_packets.publish({packet.neighbour, std::make_shared<const RelayPacket>(packet)});
  for (const RelayMessagePtr& message : output.delivered) deliver(*message);
  for (const RobotId robot : output.reachable)
    topics_.reached.publish(
        PeerEvent{PeerEventKind::kReturned, {.robot = robot, .name = {}}, {}, false});
  if (given_up > 0)
    log::limited(log::Level::kWarn, kTag, "given up")
        << given_up << " messages for others are not kept, for want of room";
}

// Messages of a new incarnation refer to other keyframes, so none is delivered before all nodes
// know of the restart.
void RelayNode::deliver(const RelayMessage& message) const {
  if (peers_.is_arriving(message.origin.robot)) return;
  const char* refusal = nullptr;
  try {
    refusal = readers_.at(message.kind)(message.origin, message.content);
  } catch (const std::exception& e) {
    refusal = "its handling threw an exception";
  }
  if (refusal != nullptr)
    log::limited(log::Level::kWarn, kTag, refusal)
        << "a message of robot " << message.origin.robot << " refused: " << refusal;
}

std::optional<RobotIdentity> RelayNode::identity_of(const TeamPeer& robot) const {
  for (const Peer& peer : peers_.list())
    if (peer.identity.robot == robot.robot && peer.identity.boot == robot.boot)
      return peer.identity;
  return std::nullopt;
}

RelayWays RelayNode::ways_to(RobotId robot) const {
  const std::lock_guard lock(mutex_);
  return store_.ways_to(robot);
}

RelaySummary RelayNode::summary() const {
  RelaySummary summary;
  {
    const std::lock_guard lock(mutex_);
    summary = store_.summary();
  }
  std::erase_if(summary.holds,
                [this](const RelayHeld& held) { return peers_.is_arriving(held.origin.robot); });
  return summary;
}

}  // namespace km
