#include "runtime/dds/peer_table.hpp"

#include <algorithm>
#include <tuple>

namespace km {
namespace {

// A robot that has been running for longer is not new: it keeps its id.
constexpr double kNew_s = 10.0;
// Two processes measure the difference of their uptimes with an error: the other uptime comes in
// steps of kStatusPeriod_s, and late if its computer is busy. A process yields at once if it is
// younger by more than kYounger_s. Unless it is older by more than kOlder_s, it yields to the lower
// boot id if the other one has not yielded after kDecided_s.
constexpr double kYounger_s = 1.0;
constexpr double kOlder_s = 5.0;
constexpr double kDecided_s = 10.0;

}  // namespace

void PeerTable::recall(const RobotIdentity& identity) {
  if (identity.robot == self_.robot || peers_.size() >= kMaxRobots) return;
  peers_.try_emplace(identity.robot, KnownPeer{{identity, PeerState::kLost, "unknown"}, Guid{}});
}

void PeerTable::reported(const RobotIdentity& identity) {
  if (identity.robot == self_.robot) return;
  const auto found = peers_.find(identity.robot);
  if (found == peers_.end()) {
    if (peers_.size() >= kMaxRobots) return;
    peers_.emplace(identity.robot, KnownPeer{{identity, PeerState::kReported, "unknown"}, Guid{}});
    return emit(PeerEventKind::kReported, identity, "reported by other robots", false);
  }
  KnownPeer& known = found->second;
  const std::uint64_t former_boot = known.peer.identity.boot;
  if (known.peer.state == PeerState::kAlive || former_boot == identity.boot) return;
  if (is_former(known, identity)) return;
  const bool resumed = is_same_incarnation(former_boot, identity.boot);
  become(known, {identity, PeerState::kReported, "unknown"}, Guid{}, known.arriving || !resumed);
  emit(resumed ? PeerEventKind::kResumed : PeerEventKind::kRestarted, identity,
       resumed ? "resumed, as other robots report" : "restarted, as other robots report", false);
}

bool PeerTable::is_arriving(RobotId robot) const {
  const auto known = peers_.find(robot);
  return known != peers_.end() && known->second.arriving;
}

void PeerTable::participant(const Guid& guid, std::string_view user_data,
                            const std::string& addresses) {
  Participant& participant = remember(guid);
  if (!addresses.empty()) participant.addresses = addresses;
  const std::size_t data =
      claims_to_be_a_robot(user_data) ? std::hash<std::string_view>()(user_data) | 2U : 1U;
  const std::size_t former = std::exchange(participant.data, data);
  const bool is_first = !std::exchange(participant.announced, true);
  if (!is_first && former == data && participant.refusal.empty()) return;

  // A robot announces the same data as long as its participant exists.
  const bool contradicts = former != 0 && former != data;
  const bool is_news = contradicts && !std::exchange(participant.forged, true);
  if (data != 1U) take_announcement(guid, participant, user_data);
  if (!is_news) return;
  ++forged_;
  const RobotIdentity identity = participant.identity.value_or(RobotIdentity());
  events_.push_back(
      {PeerEventKind::kRefused, identity,
       "forged announcements: the participant " +
           (participant.identity ? "of " + to_string(identity) + ' ' : std::string()) + "at " +
           participant.addresses + " is announced with contradicting data"});
}

// Empty if the announced robot is accepted.
std::string PeerTable::why_refused(const Announcement& announcement) const {
  const auto& [identity, credentials] = announcement;
  if (identity.protocol != self_.protocol)
    return "uses protocol version " + std::to_string(identity.protocol) + ", this robot " +
           std::to_string(self_.protocol);
  if (!admit_)
    return credentials.empty()
               ? ""
               : "it has keys of a team and this robot has none: see kimera_multi_keys and "
                 "--security";
  const char* reason = admit_(identity, credentials);
  return reason == nullptr ? "" : reason;
}

void PeerTable::take_announcement(const Guid& guid, Participant& participant,
                                  std::string_view user_data) {
  const auto decoded = parse_user_data(user_data);
  const RobotIdentity identity = decoded.value ? decoded.value->identity : RobotIdentity();
  const std::string refusal = decoded.value ? why_refused(*decoded.value) : decoded.refusal;
  if (!refusal.empty()) {
    if (participant.identity || std::exchange(participant.refusal, refusal) == refusal) return;
    if (decoded.value) participant.claimed = to_string(identity);
    if (!participant.forged)
      events_.push_back(
          {PeerEventKind::kRefused, identity, name_of(participant) + " refused: " + refusal});
    return;
  }
  participant.refusal.clear();
  participant.later.reset();
  if (participant.identity && *participant.identity != identity) {
    participant.later = identity;
    return;
  }
  participant.identity = identity;
  participant.proven |= !admit_;
  appear_if_there(guid, participant);
}

void PeerTable::network_changed() {
  std::erase_if(participants_, [this](const auto& entry) {
    return !is_robot(entry.first, entry.second);  // robots are remembered
  });
  for (auto& [guid, participant] : participants_) {
    participant.announced = participant.alive = participant.was_alive = false;
  }
  for (auto& [robot, known] : peers_)
    if (known.peer.state == PeerState::kAlive) {
      known.peer.state = PeerState::kLost;
      known.lost = ++arrivals_;
      emit(PeerEventKind::kLost, known.peer.identity, "lost: this robot's network has changed");
    }
}

void PeerTable::expel(const std::vector<TeamPeer>& processes) {
  std::vector<Guid> expelled;
  for (auto& [guid, participant] : participants_) {
    const auto& identity = participant.identity;
    if (!identity ||
        std::ranges::find(processes, TeamPeer{identity->robot, identity->boot}) == processes.end())
      continue;
    participant.proven = false;  // no successor of another process
    expelled.push_back(guid);
  }
  for (const Guid& guid : expelled) {
    give_way(guid, PeerState::kLost, PeerEventKind::kLost,
             "lost: it is no longer a member of the team");
    if (const auto found = participants_.find(guid); found != participants_.end())
      found->second.identity.reset();
  }
}

void PeerTable::prove(const Guid& guid, const TeamPeer& process) {
  const auto found = participants_.find(guid);
  if (found == participants_.end() || !found->second.identity) return;
  Participant& participant = found->second;
  if (later_claim_of(guid) == process) {
    const bool was_alive = participant.alive;
    give_way(guid, PeerState::kLost, PeerEventKind::kLost, "lost: its announcement was forged");
    participant.identity = std::exchange(participant.later, std::nullopt);
    participant.alive = was_alive;
    participant.proven = false;
  }
  if (TeamPeer{participant.identity->robot, participant.identity->boot} != process ||
      std::exchange(participant.proven, true))
    return;
  appear_if_there(guid, participant);
}

void PeerTable::restart_handled(const TeamPeer& restarted) {
  if (is_current(restarted)) peers_.at(restarted.robot).arriving = false;
}

void PeerTable::participant_gone(const Guid& guid) {
  closed(guid);
  const auto found = participants_.find(guid);
  if (found == participants_.end()) return;
  found->second.announced = false;
  if (!is_robot(guid, found->second)) participants_.erase(found);  // robots are remembered
}

void PeerTable::alive(const Guid& guid) {
  Participant& participant = remember(guid);
  participant.was_alive = true;
  if (std::exchange(participant.alive, true)) return;
  participant.arrival = ++arrivals_;
  appear_if_there(guid, participant);
}

void PeerTable::silent(const Guid& guid) {
  give_way(guid, PeerState::kLost, PeerEventKind::kLost, "lost: silent");
}

void PeerTable::closed(const Guid& guid) {
  give_way(guid, PeerState::kLeft, PeerEventKind::kLeft, "left");
}

void PeerTable::twin_received(const Guid& guid, double its_uptime_s, double own_uptime_s) {
  const auto found = participants_.find(guid);
  if (found == participants_.end() || !found->second.identity) return;
  Participant& twin = found->second;
  const std::string claim = "at " + twin.addresses + " also claims this robot's id " +
                            std::to_string(self_.robot) + ": give every robot its own --robot";
  if (!twin.twin) {
    has_met_twin_ = true;
    const double older_by_s = its_uptime_s - own_uptime_s;
    const bool is_new = own_uptime_s <= kNew_s;
    const bool yields = is_new && older_by_s > kYounger_s;
    twin.twin = {.met_s = own_uptime_s, .decided = yields || !is_new || older_by_s < -kOlder_s};
    return emit(
        yields ? PeerEventKind::kConflict : PeerEventKind::kRefused, *twin.identity,
        claim + (yields               ? "; it had the id first, and this robot ends"
                 : twin.twin->decided ? "; this robot had the id first, and keeps it"
                                      : "; both started at about the same time, and one will end"));
  }
  if (twin.twin->decided || own_uptime_s - twin.twin->met_s < kDecided_s) return;
  twin.twin->decided = true;
  if (twin.identity->boot < self_.boot)
    emit(PeerEventKind::kConflict, *twin.identity,
         claim + "; both started at about the same time, and this robot ends");
}

PeerTable::SameId PeerTable::same_id() const {
  if (!has_met_twin_) return SameId::kNone;
  const auto is_open = [](const auto& entry) {
    return entry.second.twin && !entry.second.twin->decided;
  };
  return std::ranges::any_of(participants_, is_open) ? SameId::kOpen : SameId::kKept;
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

bool PeerTable::is_announced(const Guid& guid) const {
  const auto found = participants_.find(guid);
  return found != participants_.end() && found->second.announced;
}

Standing PeerTable::standing(const Guid& guid) const {
  const auto found = participants_.find(guid);
  if (found == participants_.end()) return Standing::kUnknown;
  const Participant& participant = found->second;
  if (!participant.identity)
    return participant.announced ? Standing::kOutsider : Standing::kUnknown;
  if (participant.identity->robot == self_.robot) return Standing::kTwin;
  const auto known = peers_.find(participant.identity->robot);
  if (known == peers_.end() || known->second.guid != guid) return Standing::kRival;
  return known->second.arriving ? Standing::kArriving : Standing::kAdmitted;
}

std::optional<TeamPeer> PeerTable::later_claim_of(const Guid& guid) const {
  const auto found = participants_.find(guid);
  if (found == participants_.end() || !found->second.later) return std::nullopt;
  return TeamPeer{found->second.later->robot, found->second.later->boot};
}

bool PeerTable::receives_strangers() const {
  return std::ranges::any_of(participants_, [this](const auto& entry) {
    return entry.second.alive && why_unmet(entry.first, entry.second) != nullptr;
  });
}

bool PeerTable::is_isolated() const {
  const auto is_alive = [](const auto& entry) {
    return entry.second.peer.state == PeerState::kAlive;
  };
  return std::ranges::none_of(peers_, is_alive) &&
         std::ranges::any_of(participants_, [this](const auto& entry) {
           return !entry.second.alive && why_unmet(entry.first, entry.second) != nullptr;
         });
}

std::map<std::string, std::string> PeerTable::unmet() const {
  std::map<std::string, std::string> unmet;
  for (const auto& [guid, participant] : participants_)
    if (const char* why = why_unmet(guid, participant)) unmet[name_of(participant)] = why;
  return unmet;
}

std::string PeerTable::name_of(const Participant& participant) {
  if (participant.identity) return to_string(*participant.identity);
  return participant.claimed.empty() ? "a robot at " + participant.addresses : participant.claimed;
}

// Null for a robot of the team, present or lost, and for programs that are no robots.
const char* PeerTable::why_unmet(const Guid& guid, const Participant& participant) const {
  const bool is_mute = participant.announced && !participant.was_alive && participant.identity;
  if (!is_mute && !participant.alive) return nullptr;
  // A forged packet can keep the former participant of a process.
  const RobotIdentity identity = participant.identity.value_or(RobotIdentity());
  if (is_mute && is_current({identity.robot, identity.boot})) return nullptr;
  const Standing standing = this->standing(guid);
  if (standing == Standing::kTwin || standing == Standing::kAdmitted ||
      standing == Standing::kArriving ||
      (participant.alive && participant.identity && participant.proven))
    return nullptr;
  if (participant.forged) return "its announcements are forged";
  if (!participant.refusal.empty()) return participant.refusal.c_str();
  if (is_mute)
    return "it is announced, but sends nothing to this robot: it does not receive it (firewall, "
           "NAT, "
           "or dds.peers on one side)";
  return participant.identity ? "it has not proven its identity" : "it is not announced as a robot";
}

std::optional<TeamPeer> PeerTable::current(RobotId robot) const {
  const auto known = peers_.find(robot);
  if (known == peers_.end()) return std::nullopt;
  return TeamPeer{robot, known->second.peer.identity.boot};
}

bool PeerTable::is_current(const TeamPeer& sender) const {
  return current(sender.robot) == sender;
}

// True if the participant has its id, or had it last.
bool PeerTable::is_robot(const Guid& guid, const Participant& participant) const {
  if (!participant.identity) return false;
  const auto peer = peers_.find(participant.identity->robot);
  return peer != peers_.end() && peer->second.guid == guid;
}

void PeerTable::appear_if_there(const Guid& guid, Participant& participant) {
  if (participant.identity && participant.proven && participant.alive) appear(guid, participant);
}

void PeerTable::appear(const Guid& guid, Participant& participant) {
  const RobotIdentity& identity = *participant.identity;
  if (identity.robot == self_.robot) return;  // twin_received() decides by uptime
  const auto found = peers_.find(identity.robot);
  if (found == peers_.end()) {
    if (peers_.size() >= kMaxRobots && !make_place(identity)) {
      if (!std::exchange(participant.warned, true))
        emit(PeerEventKind::kRefused, identity,
             "waits until one of " + std::to_string(kMaxRobots) + " known robots is lost");
      return;
    }
    peers_.emplace(identity.robot,
                   KnownPeer{{identity, PeerState::kAlive, participant.addresses}, guid});
    return emit(PeerEventKind::kJoined, identity, "joined from " + participant.addresses);
  }
  KnownPeer& known = found->second;
  const bool former = is_former(known, identity);
  if (!former && (known.guid == guid || known.peer.state != PeerState::kAlive))
    return take_over(known, guid, participant);
  if (!std::exchange(participant.warned, true))
    emit(PeerEventKind::kRefused, identity,
         "at " + participant.addresses + " ignored: another process, at " + known.peer.addresses +
             (former ? ", has taken over this id: to use the id again, start it again"
                     : ", has this id until it is lost"));
}

// Gives the place of the robot that has been lost for longest. False if all are present.
bool PeerTable::make_place(const RobotIdentity& newcomer) {
  const auto rank = [](const auto& entry) {
    const KnownPeer& known = entry.second;
    return std::tuple(known.peer.state == PeerState::kAlive,
                      known.peer.state == PeerState::kReported, known.lost);
  };
  const auto longest_lost = std::ranges::min_element(peers_, {}, rank);
  if (longest_lost->second.peer.state == PeerState::kAlive) return false;
  RobotIdentity identity = longest_lost->second.peer.identity;
  identity.boot = 0;
  peers_.erase(longest_lost);
  emit(PeerEventKind::kRestarted, identity,
       "was lost for longest: its place goes to " + to_string(newcomer), false);
  return true;
}

// Lets the robot appear that has waited for a place for longest.
void PeerTable::fill_place() {
  if (peers_.size() < kMaxRobots) return;
  const auto waits = [this](const Participant& p) {
    return p.alive && p.proven && p.identity && p.identity->robot != self_.robot &&
           !peers_.contains(p.identity->robot);
  };
  const auto rank = [&](const auto& entry) {
    return std::pair(!waits(entry.second), entry.second.arrival);
  };
  const auto next = std::ranges::min_element(participants_, {}, rank);
  if (next != participants_.end() && waits(next->second)) appear(next->first, next->second);
}

// Only in a team with keys, where no other program can take over an id.
bool PeerTable::is_former(const KnownPeer& known, const RobotIdentity& identity) const {
  const std::uint64_t present = known.peer.identity.boot;
  return admit_ && ((is_same_incarnation(present, identity.boot) && identity.boot < present) ||
                    std::ranges::find(known.former, identity.boot) != known.former.end());
}

// Assigns the id to a process.
void PeerTable::become(KnownPeer& known, Peer peer, const Guid& guid, bool arriving) {
  const std::uint64_t former_boot = known.peer.identity.boot;
  if (former_boot != peer.identity.boot) {
    if (known.former.size() == kMaxFormer) known.former.erase(known.former.begin());
    known.former.push_back(former_boot);
  }
  known.peer = std::move(peer);
  known.guid = guid;
  known.arriving = arriving;
}

void PeerTable::take_over(KnownPeer& known, const Guid& guid, const Participant& participant) {
  const RobotIdentity& identity = *participant.identity;
  const std::uint64_t former_boot = known.peer.identity.boot;
  const Guid former = known.guid;
  const bool arriving = former_boot == identity.boot
                            ? known.arriving
                            : !is_same_incarnation(former_boot, identity.boot);
  become(known, {identity, PeerState::kAlive, participant.addresses}, guid, arriving);
  const auto predecessor = participants_.find(former);
  if (former != guid && predecessor != participants_.end() && !predecessor->second.announced)
    participants_.erase(predecessor);
  if (former_boot == identity.boot) return emit(PeerEventKind::kReturned, identity, "returned");
  if (is_same_incarnation(former_boot, identity.boot))
    return emit(PeerEventKind::kResumed, identity, "resumed");
  emit(PeerEventKind::kRestarted, identity, "restarted");
}

// Removes a participant that is no longer received. Its id passes to the participant that has
// claimed it for longest.
void PeerTable::give_way(const Guid& guid, PeerState state, PeerEventKind kind, const char* text) {
  const auto found = participants_.find(guid);
  if (found == participants_.end() || !std::exchange(found->second.alive, false)) return;
  if (!found->second.identity) {
    if (!found->second.announced) participants_.erase(found);
    return;
  }
  const auto entry = peers_.find(found->second.identity->robot);
  if (entry == peers_.end() || entry->second.guid != guid) return;
  KnownPeer& known = entry->second;
  known.peer.state = state;
  known.lost = ++arrivals_;
  emit(kind, known.peer.identity, text);

  auto successor = participants_.end();
  for (auto p = participants_.begin(); p != participants_.end(); ++p) {
    const Participant& claimant = p->second;
    if (!claimant.alive || !claimant.proven || !claimant.identity ||
        claimant.identity->robot != entry->first || is_former(known, *claimant.identity))
      continue;
    if (successor == participants_.end() || claimant.arrival < successor->second.arrival)
      successor = p;
  }
  if (successor != participants_.end())
    return take_over(known, successor->first, successor->second);
  fill_place();
}

// Makes room for a new participant if there are too many.
PeerTable::Participant& PeerTable::remember(const Guid& guid) {
  if (const auto found = participants_.find(guid); found != participants_.end())
    return found->second;
  if (participants_.size() >= kMaxParticipants)
    participants_.erase(std::ranges::min_element(participants_, {}, [this](const auto& entry) {
      return std::tuple(is_robot(entry.first, entry.second), entry.second.alive,
                        entry.second.arrival);
    }));
  Participant& participant = participants_[guid];
  participant.arrival = ++arrivals_;
  return participant;
}

void PeerTable::emit(PeerEventKind kind, const RobotIdentity& identity, const std::string& text,
                     bool direct) {
  events_.push_back({kind, identity, to_string(identity) + ' ' + text, direct});
}

}  // namespace km
