#include "modules/session/team_roster.hpp"

#include <utility>

namespace km {

TeamRoster::Meeting TeamRoster::meet(const TeamPeer& peer) {
  const auto [entry, added] = peers_.try_emplace(peer.robot, Peer{.boot = peer.boot});
  if (added) return Meeting::kNew;
  const std::uint64_t before = entry->second.boot;
  if (before == peer.boot) return Meeting::kKnown;
  public_poses_.erase(peer.robot);
  results_.erase(peer.robot);
  entry->second = Peer{.boot = peer.boot};
  return is_same_incarnation(before, peer.boot) ? Meeting::kOtherProcess
                                                : Meeting::kOtherIncarnation;
}

void TeamRoster::take(const TeamStatus& status) {
  Peer& peer = at(status.sender.robot);
  peer.other_method = status.method != method_;
  peer.status = status;
}

void TeamRoster::take(const Session& session) {
  at(session.id.coordinator.robot).session = session;
}

const TeamRoster::Peer* TeamRoster::find(RobotId robot) const {
  const auto known = peers_.find(robot);
  return known == peers_.end() ? nullptr : &known->second;
}

bool TeamRoster::in_reach(const TeamPeer& peer) const {
  if (peer == self_) return true;
  const Peer* known = find(peer.robot);
  return known != nullptr && known->boot == peer.boot && component_.contains(peer.robot);
}

std::map<RobotId, TeamStatus> TeamRoster::statuses(TeamStatus own) const {
  std::map<RobotId, TeamStatus> statuses;
  statuses.emplace(self_.robot, std::move(own));
  for (const auto& [robot, peer] : peers_) {
    if (!peer.status || peer.other_method || !in_reach(peer.status->sender)) continue;
    statuses.emplace(robot, *peer.status);
  }
  return statuses;
}

}  // namespace km
