#include "modules/relay/relay_node.hpp"

#include <exception>
#include <string>
#include <utility>

#include "runtime/log.hpp"

namespace km {
namespace {

constexpr const char* kTag = "relay";

}  // namespace

RelayNode::RelayNode(TeamPeer self, bool relays, Peers& peers, const RelayTopics& topics,
                     std::function<double()> now_s)
    : relays_(relays), peers_(peers), topics_(topics), now_s_(std::move(now_s)), store_(self) {
  if (!relays_) return;
  topics.peer_events.subscribe([this](const auto& event) { take(*event); });
  topics.statuses.subscribe([this](const auto& status) {
    act([&](RelayStore& store) { store.told(status->robot, status->relay, now_s_()); });
  });
  topics.parcels.subscribe([this](const auto& parcel) { take(*parcel); });
}

void RelayNode::take(const PeerEvent& event) {
  if (!event.heard) return;
  act([&](RelayStore& store) {
    switch (event.kind) {
      case PeerEventKind::kJoined:
      case PeerEventKind::kReturned:
      case PeerEventKind::kResumed:
      case PeerEventKind::kRestarted:
        return store.heard(event.identity);
      case PeerEventKind::kLost:
      case PeerEventKind::kLeft:
        return store.lost(event.identity.robot, now_s_());
      case PeerEventKind::kTold:
      case PeerEventKind::kRefused:
      case PeerEventKind::kConflict:
        return;
    }
  });
}

void RelayNode::take(const RelayParcel& parcel) {
  act([&](RelayStore& store) {
    if (store.receive(parcel) == RelayArrival::kRefused)
      log::limited(log::Level::kDebug, kTag, "refused " + std::to_string(parcel.neighbour))
          << "robot " << parcel.neighbour << " hands over a message of robot "
          << parcel.message->origin.robot << " that is not taken";
  });
}

void RelayNode::carry_out(const RelayOutput& output, std::uint64_t given_up) {
  for (const RobotIdentity& robot : output.met) peers_.tell(robot);
  for (const RelayParcel& parcel : output.parcels)
    topics_.own_parcels.publish({parcel.neighbour, std::make_shared<const RelayParcel>(parcel)});
  for (const RelayMessagePtr& message : output.delivered) deliver(*message);
  for (const RobotId robot : output.reachable)
    topics_.reached.publish(
        PeerEvent{PeerEventKind::kReturned, {.robot = robot, .name = {}}, {}, false});
  if (given_up > 0)
    log::limited(log::Level::kWarn, kTag, "given up")
        << given_up << " messages for others are not kept, for want of room";
}

// In another life its messages are about other keyframes: not before all nodes know.
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

std::optional<RobotIdentity> RelayNode::identity_of(RobotId robot) const {
  for (const Peer& peer : peers_.list())
    if (peer.identity.robot == robot) return peer.identity;
  return std::nullopt;
}

RelayWays RelayNode::ways_to(RobotId robot) const {
  if (!relays_) return {};
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
