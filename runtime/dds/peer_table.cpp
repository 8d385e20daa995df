#include "runtime/dds/peer_table.hpp"

#include <algorithm>

namespace km {
namespace {

// A former self is silent after the liveliness period; this much later it must be alive.
constexpr double kConflictMargin_s = 1.0;

}  // namespace

PeerTable::PeerTable(const RobotIdentity& self, double liveliness_s)
    : self_(self), conflict_after_s_(liveliness_s + kConflictMargin_s) {}

void PeerTable::participant(const Guid& guid, std::string_view user_data,
                            const std::string& addresses, double now_s) {
  if (!claims_to_be_a_robot(user_data)) return;
  Participant& participant = participants_[guid];
  participant.addresses = addresses;
  if (std::exchange(participant.announced, true)) return;

  const auto decoded = parse_user_data(user_data);
  if (!decoded.value) {
    const RobotIdentity unreadable;
    const std::string text = "a robot at " + addresses + " refused: " + decoded.refusal;
    events_.push_back({PeerEventKind::kRefused, unreadable, text});
    return;
  }
  if (decoded.value->protocol != self_.protocol)
    return emit(PeerEventKind::kRefused, *decoded.value,
                "refused: speaks protocol version " + std::to_string(decoded.value->protocol) +
                    ", this robot " + std::to_string(self_.protocol));
  participant.identity = *decoded.value;
  met_.emplace(decoded.value->robot, decoded.value->boot);
  if (participant.alive) appear(guid, now_s);
}

void PeerTable::participant_gone(const Guid& guid) {
  closed(guid);
  const auto found = participants_.find(guid);
  if (found == participants_.end()) return;
  found->second.announced = false;
  if (!found->second.identity) participants_.erase(found);  // robots are remembered
}

void PeerTable::alive(const Guid& guid, double now_s) {
  Participant& participant = participants_[guid];
  if (std::exchange(participant.alive, true)) return;
  if (participant.identity) appear(guid, now_s);
}

void PeerTable::silent(const Guid& guid) {
  const auto found = participants_.find(guid);
  if (found == participants_.end() || !std::exchange(found->second.alive, false)) return;
  KnownPeer* known = peer_at(guid);
  if (known == nullptr || known->peer.state != PeerState::kAlive) return;
  known->peer.state = PeerState::kLost;
  emit(PeerEventKind::kLost, known->peer.identity, "lost: silent");
}

void PeerTable::closed(const Guid& guid) {
  const auto found = participants_.find(guid);
  if (found == participants_.end() || !std::exchange(found->second.alive, false)) return;
  KnownPeer* known = peer_at(guid);
  if (known == nullptr || known->peer.state != PeerState::kAlive) return;
  known->peer.state = PeerState::kLeft;
  emit(PeerEventKind::kLeft, known->peer.identity, "left");
}

void PeerTable::tick(double now_s) {
  const auto is_over = [&](const Rival& rival) {
    const auto found = participants_.find(rival.guid);
    if (found == participants_.end() || !found->second.alive) return true;
    if (now_s - rival.since_s < conflict_after_s_) return false;
    const RobotIdentity& identity = *found->second.identity;
    emit(PeerEventKind::kConflict, identity,
         "two living processes claim robot id " + std::to_string(identity.robot) +
             ": give every robot its own --robot");
    return true;
  };
  std::erase_if(rivals_, is_over);
}

std::vector<Peer> PeerTable::peers() const {
  std::vector<Peer> result;
  for (const auto& [robot, known] : peers_) result.push_back(known.peer);
  return result;
}

std::optional<RobotIdentity> PeerTable::identity_of(const Guid& guid) const {
  const auto found = participants_.find(guid);
  return found == participants_.end() ? std::nullopt : found->second.identity;
}

bool PeerTable::has_met(RobotId robot, std::uint64_t boot) const {
  return met_.contains({robot, boot});
}

// The participant is accepted and its status writer alive.
void PeerTable::appear(const Guid& guid, double now_s) {
  const Participant& participant = participants_.at(guid);
  const RobotIdentity& identity = *participant.identity;
  if (identity.robot == self_.robot)
    return emit(PeerEventKind::kConflict, identity,
                "also claims this robot's id " + std::to_string(identity.robot) +
                    ": give every robot its own --robot");

  const auto [entry, fresh] = peers_.try_emplace(
      identity.robot, KnownPeer{{identity, PeerState::kAlive, participant.addresses}, guid});
  if (fresh) return emit(PeerEventKind::kJoined, identity, "joined from " + participant.addresses);
  meet_again(entry->second, guid, participant, now_s);
}

void PeerTable::meet_again(KnownPeer& known, const Guid& guid, const Participant& participant,
                           double now_s) {
  const RobotIdentity& identity = *participant.identity;
  const bool same_boot = known.peer.identity.boot == identity.boot;
  const bool was_alive = known.peer.state == PeerState::kAlive;
  if (!same_boot && was_alive) rivals_.push_back({known.guid, now_s});
  known = {{identity, PeerState::kAlive, participant.addresses}, guid};
  if (!same_boot) {
    emit(PeerEventKind::kRestarted, identity, "restarted");
  } else if (!was_alive) {
    emit(PeerEventKind::kReturned, identity, "returned");
  }
}

void PeerTable::emit(PeerEventKind kind, const RobotIdentity& identity, const std::string& text) {
  events_.push_back({kind, identity, to_string(identity) + ' ' + text});
}

PeerTable::KnownPeer* PeerTable::peer_at(const Guid& guid) {
  const auto found = std::ranges::find(peers_, guid, [](const auto& e) { return e.second.guid; });
  return found == peers_.end() ? nullptr : &found->second;
}

}  // namespace km
