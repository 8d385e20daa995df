#include "runtime/overlay/overlay_node.hpp"

#include <chrono>
#include <string>

#include "runtime/log.hpp"

namespace km {
namespace {

constexpr const char* kTag = "overlay";
constexpr std::chrono::milliseconds kTick{50};

std::int64_t today_s() {
  return static_cast<std::int64_t>(wall_now_s());
}

std::optional<OverlayKeys> keys_of(SharedSeal* seal) {
  if (seal == nullptr) return std::nullopt;
  return OverlayKeys{
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

bool is_of_session(OverlayStream stream) {
  return stream == OverlayStream::kSession || stream == OverlayStream::kMemberPoses ||
         stream == OverlayStream::kSolver;
}

}  // namespace

OverlayNode::OverlayNode(TeamPeer self, SharedSeal* seal, Peers& peers, const OverlayTopics& topics,
                         std::function<double()> now_s)
    : self_(self),
      keys_(keys_of(seal)),
      peers_(peers),
      topics_(topics),
      now_s_(std::move(now_s)),
      overlay_(self, keys_),
      ticks_(
          kTick, [this] { step(); }, "overlay tick") {
  topics.peer_events.subscribe([this](const auto& event) { take(*event); });
  topics.statuses.subscribe([this](const auto& status) {
    act([&](Overlay& overlay) { overlay.update(status->robot, status->overlay, now_s_()); });
  });
}

void OverlayNode::step() {
  std::optional<LinksReport> links;
  act([&](Overlay& overlay) {
    overlay.step(now_s_());
    const KnownRobots& robots = overlay.robots();
    if (std::exchange(links_version_, robots.links_version()) != robots.links_version())
      links = LinksReport{robots.links(), robots.links_version()};
  });
  if (links) topics_.links.publish(std::move(*links));
}

void OverlayNode::publish(OverlayStream stream, std::vector<std::uint8_t> content) {
  act([&](Overlay& overlay) { overlay.publish(stream, std::move(content), now_s_()); });
}

void OverlayNode::call(OverlayStream stream, RobotId to, std::uint32_t number,
                       std::vector<std::uint8_t> content) {
  act([&](Overlay& overlay) { (void)overlay.call(stream, to, number, std::move(content)); });
}

void OverlayNode::take(const PeerEvent& event) {
  if (!event.direct) return;
  act([&](Overlay& overlay) {
    switch (event.kind) {
      case PeerEventKind::kJoined:
      case PeerEventKind::kReturned:
      case PeerEventKind::kResumed:
      case PeerEventKind::kRestarted:
        return overlay.connected(event.identity, now_s_());
      case PeerEventKind::kLost:
      case PeerEventKind::kLeft:
        return overlay.lost(event.identity.robot, now_s_());
      case PeerEventKind::kReported:
      case PeerEventKind::kRefused:
      case PeerEventKind::kConflict:
        return;
    }
  });
}

// Returns the reason of a refusal that the sender causes, otherwise null. A message that this robot
// does not expect, because it has missed an earlier one, is none.
const char* OverlayNode::take(const TeamPeer& sender, const OverlayPacket& packet) {
  bool is_known = false;
  {
    const std::lock_guard lock(mutex_);
    is_known = overlay_.robots().is_known(sender);
  }
  // A message may arrive before the PeerEvent of its sender.
  const auto from = is_known ? RobotIdentity{.robot = sender.robot, .name = {}, .boot = sender.boot}
                             : identity_of(sender).value_or(RobotIdentity());
  if (from.boot == 0) return "its sender is unknown";
  OverlayArrival arrival = OverlayArrival::kNew;
  const char* refusal = nullptr;
  act([&](Overlay& overlay) {
    arrival = overlay.receive(from, packet.message, now_s_());
    if (arrival == OverlayArrival::kForged) refusal = overlay.refusal();
  });
  if (arrival == OverlayArrival::kRefused)
    log::limited(log::Level::kDebug, kTag, "refused " + std::to_string(sender.robot))
        << "robot " << sender.robot << " forwards a message of robot "
        << packet.message->origin.robot << ", which is refused";
  return arrival == OverlayArrival::kNoRoom ? "no room for it" : refusal;
}

// Stores a directly received message for other robots. Returns the reason if it is forged,
// otherwise null.
const char* OverlayNode::keep(OverlayStream stream, const TeamPeer& sender, std::uint32_t number,
                              std::span<const std::uint8_t> content) {
  const char* forged = nullptr;
  const auto note = [&](const Overlay& overlay, OverlayArrival arrival) {
    if (arrival == OverlayArrival::kForged) forged = overlay.refusal();
  };
  std::vector<std::uint8_t> octets(content.begin(), content.end());
  if (stream == OverlayStream::kReply) {
    act([&](Overlay& overlay) {
      note(overlay, overlay.keep_reply(sender, number, std::move(octets)));
    });
  } else if (const auto origin = identity_of(sender)) {
    // A message may arrive before the PeerEvent of its sender.
    act([&](Overlay& overlay) {
      note(overlay, overlay.keep_bag(*origin, number, std::move(octets)));
    });
  }
  return forged;
}

std::vector<std::uint8_t> OverlayNode::signature_of(OverlayStream stream, std::uint32_t number,
                                                    std::span<const std::uint8_t> content) const {
  const Signature signature = endorsement_of({.stream = stream,
                                              .origin = self_,
                                              .number = number,
                                              .content = {content.begin(), content.end()}},
                                             *keys_);
  return {signature.begin(), signature.end()};
}

void OverlayNode::carry_out(const OverlayOutput& output, std::uint64_t given_up) {
  for (const RobotIdentity& robot : output.met) peers_.tell(&PeerTable::reported, robot);
  for (const RobotId robot : output.renewed) {
    log::limited(log::Level::kWarn, kTag, "renewed " + std::to_string(robot))
        << "packets do not arrive at robot " << robot << ": the DDS writers to it are renewed";
    topics_.renew(robot);
  }
  for (const OverlayPacket& packet : output.packets) send(packet);
  for (const OverlayMessagePtr& message : output.delivered) deliver(*message);
  for (const RobotId robot : output.reachable)
    topics_.reached.publish(
        PeerEvent{PeerEventKind::kReturned, {.robot = robot, .name = {}}, {}, false});
  if (given_up > 0)
    log::limited(log::Level::kWarn, kTag, "given up")
        << "the storage for other robots is full: " << given_up << " messages are lost";
}

void OverlayNode::send(const OverlayPacket& packet) {
  constexpr std::uint64_t kHeadBytes = 8;
  if (is_of_session(packet.message->stream))
    session_bytes_ += kHeadBytes + packet.message->content.size();
  const auto publish = [&]<typename Packet>(const Out<Addressed<Packet>>& lane) {
    lane.publish({packet.neighbour, std::make_shared<const Packet>(Packet{packet})});
  };
  if (lane_of(packet.message->stream) == OverlayLane::kTeam)
    publish(topics_.team_packets);
  else
    publish(topics_.places_packets);
}

// Events, requests and replies of a new incarnation refer to other keyframes, so none is delivered
// before all nodes know of the restart. Readers of other streams distinguish the processes.
void OverlayNode::deliver(const OverlayMessage& message) const {
  const auto reader = readers_.find(message.stream);
  if (reader == readers_.end()) return;
  const bool waits = message.stream > OverlayStream::kSolver;
  if (waits && peers_.ask(&PeerTable::is_arriving, message.origin.robot)) return;
  const char* refusal = nullptr;
  try {
    refusal = reader->second(message);
  } catch (const std::exception& e) {
    refusal = "its handling threw an exception";
  }
  if (refusal != nullptr)
    log::limited(log::Level::kWarn, kTag, refusal)
        << "a message of robot " << message.origin.robot << " refused: " << refusal;
}

std::optional<RobotIdentity> OverlayNode::identity_of(const TeamPeer& robot) const {
  for (const Peer& peer : peers_.list())
    if (peer.identity.robot == robot.robot && peer.identity.boot == robot.boot)
      return peer.identity;
  return std::nullopt;
}

OverlayWays OverlayNode::ways_to(RobotId robot) const {
  const std::lock_guard lock(mutex_);
  return overlay_.ways_to(robot);
}

OverlaySummary OverlayNode::summary() const {
  OverlaySummary summary;
  {
    const std::lock_guard lock(mutex_);
    summary = overlay_.summary();
  }
  std::erase_if(summary.holds, [this](const OverlayHeld& held) {
    return peers_.ask(&PeerTable::is_arriving, held.origin.robot);
  });
  return summary;
}

}  // namespace km
