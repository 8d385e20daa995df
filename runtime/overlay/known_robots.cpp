#include "runtime/overlay/known_robots.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace km {

Meeting KnownRobots::meet(const RobotIdentity& identity) {
  const auto known = robots_.find(identity.robot);
  const bool stays = known != robots_.end() && known->second.identity.boot == identity.boot &&
                     known->second.certificate;
  Robot robot = stays ? known->second : certified(identity);
  robot.identity = identity;
  robot.was_direct = true;
  return become(std::move(robot));
}

// A process that this robot receives directly, with its credentials and certificate.
KnownRobots::Robot KnownRobots::certified(const RobotIdentity& identity) const {
  Robot robot{.identity = identity};
  if (!keys_) return robot;
  const auto credentials = keys_->credentials_of({identity.robot, identity.boot});
  if (!credentials) return robot;
  robot.credentials = *credentials;
  robot.certificate = keys_->certified(identity, *credentials).value;
  return robot;
}

Meeting KnownRobots::become(Robot robot) {
  const RobotId id = robot.identity.robot;
  const auto known = robots_.find(id);
  if (known == robots_.end()) {
    if (robots_.size() >= kMaxTeam) return Meeting::kNoRoom;
    robots_.emplace(id, std::move(robot));
    return Meeting::kNew;
  }
  const auto key_of = [](const Robot& one) {
    return one.certificate ? one.certificate->key : PublicKey{};
  };
  const std::uint64_t former = known->second.identity.boot;
  const bool other_key = key_of(known->second) != key_of(robot);
  robot.was_direct |= known->second.was_direct;
  robot.lost_s = known->second.lost_s;
  known->second = std::move(robot);
  const std::uint64_t boot = known->second.identity.boot;
  if (former == boot) return Meeting::kKnown;
  forget_report(id);
  for (const auto& [reporter, received] : reports_) renew_report(reporter);
  return other_key || !is_same_incarnation(former, boot) ? Meeting::kOtherContent
                                                         : Meeting::kOtherProcess;
}

KnownRobots::Introduced KnownRobots::introduce(const OverlayMessage& message) {
  const auto content = parse_introduction(message.content);
  if (!content || (!keys_ && !content->credentials.empty())) return {};
  const TeamPeer peer = message.origin;
  if (receives(peer.robot)) return {OverlayArrival::kRepeated};
  if (const auto known = process(peer.robot)) {
    if (known->boot == peer.boot) return {OverlayArrival::kRepeated};
    if (!is_reported(peer)) return {};
  } else if (robots_.size() >= kMaxTeam) {
    return {OverlayArrival::kNoRoom};
  }
  const RobotIdentity identity{.robot = peer.robot, .name = content->name, .boot = peer.boot};
  Robot robot{.identity = identity, .credentials = content->credentials};
  if (keys_) {
    Decoded<Certificate> certificate = keys_->certified(identity, content->credentials);
    refusal_ = certificate.refusal;
    if (!certificate.value) return {OverlayArrival::kForged};
    robot.certificate = std::move(certificate.value);
  }
  return {OverlayArrival::kNew, become(std::move(robot)), identity};
}

std::optional<OverlayMessage> KnownRobots::introduction(RobotId neighbour, RobotId robot,
                                                        double now_s) {
  const Robot& known = robots_.at(robot);
  const TeamPeer peer{robot, known.identity.boot};
  if (keys_ && !known.certificate) return std::nullopt;  // No robot would accept it.
  if (knows(neighbour, peer)) return std::nullopt;
  const auto [introduced, first] = neighbours_.at(neighbour).introduced_s.try_emplace(robot, now_s);
  if (!first && now_s - introduced->second < kIntroduceAgain_s) return std::nullopt;
  introduced->second = now_s;
  return OverlayMessage{.stream = OverlayStream::kIntroduction,
                        .origin = peer,
                        .content = to_octets({known.identity.name, known.credentials})};
}

void KnownRobots::forget(RobotId robot) {
  robots_.erase(robot);
  forget_report(robot);
  if (gone_.erase(robot) > 0) renew_own_links();
}

std::optional<RobotId> KnownRobots::replaceable() const {
  const auto rank = [this](const auto& entry) {
    return std::tuple(receives(entry.first), entry.second.was_direct, entry.second.lost_s);
  };
  const auto first = std::ranges::min_element(robots_, {}, rank);
  if (first == robots_.end() || receives(first->first)) return std::nullopt;
  return first->first;
}

std::optional<TeamPeer> KnownRobots::process(RobotId robot) const {
  const auto known = robots_.find(robot);
  if (known == robots_.end()) return std::nullopt;
  return TeamPeer{robot, known->second.identity.boot};
}

bool KnownRobots::is_known(const TeamPeer& peer) const {
  return process(peer.robot) == peer && (!keys_ || robots_.at(peer.robot).certificate.has_value());
}

bool KnownRobots::knows(RobotId neighbour, const TeamPeer& peer) const {
  const auto report = reports_.find(neighbour);
  if (report != reports_.end() && std::ranges::binary_search(report->second, peer)) return true;
  const auto& holds = neighbours_.at(neighbour).holds;
  const auto held = holds.find(peer.robot);
  return held != holds.end() && held->second.origin == peer;
}

void KnownRobots::sign(OverlayMessage& message) const {
  if (keys_) endorse(message, *keys_);
}

Proof KnownRobots::check(const OverlayMessage& message) {
  if (!keys_) return Proof::kValid;
  const Certificate& certificate = *robots_.at(message.origin.robot).certificate;
  refusal_ = keys_->why_lapsed(certificate);
  if (refusal_ != nullptr) return Proof::kLapsed;
  if (is_endorsed(message, certificate.key)) return Proof::kValid;
  refusal_ = "not signed by its origin, or changed on its way";
  return Proof::kForged;
}

void KnownRobots::connect(RobotId robot) {
  gone_.erase(robot);
  neighbours_[robot] = {};
  renew_own_links();
}

bool KnownRobots::has_lapsed(RobotId robot) const {
  const auto known = robots_.find(robot);
  return keys_ && known != robots_.end() && known->second.certificate &&
         keys_->why_lapsed(*known->second.certificate) != nullptr;
}

bool KnownRobots::disconnect(RobotId robot, double now_s) {
  if (neighbours_.erase(robot) == 0) return false;
  Robot& known = robots_.at(robot);
  known.lost_s = now_s;
  gone_[robot] = {known.identity.boot, now_s};
  return true;
}

void KnownRobots::expire(double now_s) {
  const auto is_over = [&](const auto& gone) {
    return now_s - gone.second.since_s >= kLinkPatience_s;
  };
  if (std::erase_if(gone_, is_over) > 0) renew_own_links();
}

std::vector<TeamPeer> KnownRobots::own_links() const {
  std::vector<TeamPeer> links;
  for (const auto& [robot, neighbour] : neighbours_)
    links.push_back({robot, robots_.at(robot).identity.boot});
  for (const auto& [robot, gone] : gone_) links.push_back({robot, gone.boot});
  std::ranges::sort(links);
  return links;
}

void KnownRobots::renew_own_links() {
  std::set<RobotId> received;
  for (const TeamPeer& peer : own_links()) received.insert(peer.robot);
  count_change(links_.report(self_.robot, std::move(received)));
}

void KnownRobots::report(RobotId robot, std::vector<TeamPeer> received) {
  reports_[robot] = std::move(received);
  renew_report(robot);
}

void KnownRobots::forget_report(RobotId robot) {
  if (reports_.erase(robot) == 0) return;
  links_.forget(robot);
  count_change(true);
}

// A former process of a robot has no links.
void KnownRobots::renew_report(RobotId robot) {
  std::set<RobotId> received;
  for (const TeamPeer& peer : reports_.at(robot)) {
    const auto known = peer.robot == self_.robot ? self_ : process(peer.robot).value_or(peer);
    if (known == peer) received.insert(peer.robot);
  }
  count_change(links_.report(robot, std::move(received)));
}

bool KnownRobots::is_reported(const TeamPeer& peer) const {
  for (const RobotId robot : links_.component(self_.robot)) {
    const auto report = reports_.find(robot);
    if (robot != peer.robot && report != reports_.end() &&
        std::ranges::binary_search(report->second, peer))
      return true;
  }
  return false;
}

bool KnownRobots::has_far() const {
  return std::ranges::any_of(reports_, [&](const auto& report) {
    return std::ranges::any_of(report.second, [&](const TeamPeer& peer) {
      return peer.robot != self_.robot && !receives(peer.robot);
    });
  });
}

std::optional<RobotId> KnownRobots::next_hop(RobotId to, std::optional<RobotId> from) const {
  if (receives(to)) return to;
  const auto distances = links_.distances(to);
  std::optional<RobotId> next;
  std::size_t least = 0;
  for (const auto& [robot, neighbour] : neighbours_) {
    const auto distance = distances.find(robot);
    if (distance == distances.end() || robot == from || !links_.linked(self_.robot, robot))
      continue;
    if (next && least <= distance->second) continue;
    next = robot;
    least = distance->second;
  }
  return next;
}

}  // namespace km
