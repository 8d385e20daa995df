#include "modules/pose_graph/relay.hpp"

#include <algorithm>

#include "modules/core/bytes.hpp"

namespace km {
namespace {

constexpr std::size_t kStatusKind = 0;

// Longest time between two attempts to forward messages that a neighbour lacks [periods].
constexpr double kMaxPatience = 16.0;

// Number of copies of reliable messages remembered per pair of robots; older copies count as seen.
constexpr std::size_t kRememberedCopies = 256;

// Memory of a flooded message [bytes].
std::size_t bytes_of(const TeamMessage& message) {
  const auto bytes = [](const auto&... lists) {
    return (sizeof(TeamMessage) + ... +
            (lists.size() * sizeof(typename std::decay_t<decltype(lists)>::value_type)));
  };
  if (const auto* status = std::get_if<TeamStatus>(&message))
    return bytes(status->receives, status->offers);
  if (const auto* session = std::get_if<Session>(&message))
    return bytes(session->plan.members, session->plan.pairs);
  const auto& poses = std::get<MemberPoses>(message);
  return bytes(poses.keyframes, poses.T_frame_kf, poses.verdicts);
}

// Number of a flooded message.
std::uint32_t number_of(const TeamMessage& message) {
  return std::visit([](const auto& m) { return m.number; }, message);
}

}  // namespace

void Relay::meet(const TeamPeer& peer) {
  const auto [known, is_new] = origins_.try_emplace(peer.robot, Origin{peer.boot});
  if (is_new || known->second.boot == peer.boot) return;
  for (const auto& held : known->second.newest)
    if (held) held_from_[held->from] -= held->bytes;
  known->second = Origin{peer.boot};
  for (auto& [robot, neighbour] : direct_)
    std::erase_if(neighbour.served,
                  [&](const auto& entry) { return entry.first.first == peer.robot; });
  renew_links();
}

void Relay::link_up(TeamPeer peer, double now_s) {
  if (peer.robot == self_.robot) return;
  meet(peer);
  gone_.erase(peer.robot);
  direct_[peer.robot] = Neighbour{.boot = peer.boot, .patience_s = period_s_};
  direct_[peer.robot].repair_s = now_s + period_s_;
  renew_own_links();
  for (const auto& [robot, origin] : origins_)
    for (std::size_t kind = 0; kind < kFlooded; ++kind)
      if (robot != peer.robot && origin.newest[kind] && !links_.linked(peer.robot, robot))
        send(peer.robot, robot, kind, now_s);
}

void Relay::link_down(RobotId robot, double now_s) {
  const auto neighbour = direct_.find(robot);
  if (neighbour == direct_.end()) return;
  gone_[robot] = {neighbour->second.boot, now_s};
  direct_.erase(neighbour);
}

void Relay::step(double now_s) {
  if (std::erase_if(
          gone_, [&](const auto& gone) { return now_s - gone.second.since_s >= kPatience_s; }) > 0)
    renew_own_links();
}

std::vector<TeamPeer> Relay::receives() const {
  std::vector<TeamPeer> receives;
  for (const auto& [robot, neighbour] : direct_) receives.push_back({robot, neighbour.boot});
  for (const auto& [robot, gone] : gone_) receives.push_back({robot, gone.boot});
  std::sort(receives.begin(), receives.end());
  return receives;
}

void Relay::renew_own_links() {
  std::set<RobotId> received;
  for (const TeamPeer& peer : receives()) received.insert(peer.robot);
  links_version_ += links_.report(self_.robot, std::move(received)) ? 1 : 0;
}

void Relay::report_links(const TeamStatus& status) {
  std::set<RobotId> received;
  for (const TeamPeer& peer : status.receives) {
    const auto known = origins_.find(peer.robot);
    const bool former = peer.robot == self_.robot
                            ? peer.boot != self_.boot
                            : known != origins_.end() && known->second.boot != peer.boot;
    if (!former) received.insert(peer.robot);
  }
  links_version_ += links_.report(status.sender.robot, std::move(received)) ? 1 : 0;
}

void Relay::renew_links() {
  for (const auto& [robot, origin] : origins_) {
    if (robot == self_.robot) continue;
    if (!origin.newest[kStatusKind]) {
      links_.forget(robot);
      ++links_version_;
    } else {
      report_links(std::get<TeamStatus>(*origin.newest[kStatusKind]->message));
    }
  }
}

bool Relay::received_by_any(const TeamPeer& peer) const {
  for (const RobotId robot : links_.component(self_.robot)) {
    const auto known = origins_.find(robot);
    if (known == origins_.end() || !known->second.newest[kStatusKind]) continue;
    const auto& status = std::get<TeamStatus>(*known->second.newest[kStatusKind]->message);
    if (robot != peer.robot &&
        std::find(status.receives.begin(), status.receives.end(), peer) != status.receives.end())
      return true;
  }
  return false;
}

bool Relay::accepts(const TeamPeer& origin) {
  if (origin.robot == self_.robot) return false;
  const auto known = origins_.find(origin.robot);
  if (known == origins_.end() && origins_.size() >= kMaxTeam) return false;
  if (known != origins_.end() && known->second.boot != origin.boot &&
      (direct_.contains(origin.robot) || !received_by_any(origin)))
    return false;
  meet(origin);
  return true;
}

void Relay::send(RobotId next, RobotId origin, std::size_t kind, double now_s) {
  const Held& held = *origins_.at(origin).newest[kind];
  direct_.at(next).served[{origin, kind}] = {held.number, now_s, false};
  packets_.push_back({next, held.message});
}

std::size_t Relay::publish(TeamMessage message, double now_s) {
  const std::size_t kind = message.index();
  if (kind >= kFlooded) {
    auto& reliable = std::get<ReliableMessage>(message);
    reliable.copy = copies_[reliable.to]++;
    const auto next = next_hop(reliable.to);
    if (!next) return 0;
    packets_.push_back({*next, std::make_shared<const TeamMessage>(std::move(message))});
    return 1;
  }
  std::visit([&](auto& m) { m.number = ++numbers_[kind]; }, message);
  Origin& own = origins_.try_emplace(self_.robot, Origin{self_.boot}).first->second;
  own.newest[kind] = Held{nullptr, numbers_[kind], now_s};
  if (auto* status = std::get_if<TeamStatus>(&message)) {
    status->receives = receives();
    status->holds = holds();
  }
  own.newest[kind]->message = std::make_shared<const TeamMessage>(std::move(message));
  for (const auto& [robot, neighbour] : direct_) send(robot, self_.robot, kind, now_s);
  return direct_.size();
}

void Relay::repeat_status(double now_s) {
  const auto own = origins_.find(self_.robot);
  if (own == origins_.end() || !own->second.newest[kStatusKind]) return;
  Held& held = *own->second.newest[kStatusKind];
  auto status = std::get<TeamStatus>(*held.message);
  status.holds = holds();
  held.message = std::make_shared<const TeamMessage>(std::move(status));
  for (const auto& [robot, neighbour] : direct_) send(robot, self_.robot, kStatusKind, now_s);
}

std::uint64_t Relay::holds() const {
  std::uint64_t hash = kFnv1aBasis;
  for (const auto& [robot, origin] : origins_)
    for (std::size_t kind = 0; kind < kFlooded; ++kind) {
      if (!origin.newest[kind]) continue;
      for (const std::uint64_t value : {std::uint64_t{robot}, origin.boot, std::uint64_t{kind},
                                        std::uint64_t{origin.newest[kind]->number}})
        mix_fnv1a(hash, value);
    }
  return hash;
}

Arrival Relay::receive(RobotId from, const TeamMessagePtr& message, double now_s) {
  const std::size_t kind = message->index();
  if (kind >= kFlooded) return route(from, message);
  const TeamPeer& sender = origin_of(*message);
  if (sender.robot == self_.robot) return Arrival::kRepeated;
  if (!accepts(sender)) return Arrival::kRefused;
  const std::uint32_t number = number_of(*message);
  std::optional<Held>& held = origins_.at(sender.robot).newest[kind];
  const bool newer = !held || held->number < number;
  if (newer) {
    if (!hold(held, {message, number, now_s, from, bytes_of(*message)})) return Arrival::kNoRoom;
    if (const auto* status = std::get_if<TeamStatus>(message.get())) report_links(*status);
  }
  if (const auto neighbour = direct_.find(from); neighbour != direct_.end()) {
    Served& served = neighbour->second.served[{sender.robot, kind}];
    if (served.number <= number) served = {number, now_s, true};
    const auto* status = std::get_if<TeamStatus>(message.get());
    if (status != nullptr && sender.robot == from && number == held->number)
      compare(*status, now_s);
  }
  if (!newer) return Arrival::kRepeated;
  pass_on(from, sender.robot, kind, now_s);
  return Arrival::kNew;
}

// False if there is no room for `newer`.
bool Relay::hold(std::optional<Held>& held, Held newer) {
  std::size_t& bytes = held_from_[newer.from];
  const std::size_t freed = held && held->from == newer.from ? held->bytes : 0;
  if (bytes - freed + newer.bytes > kMaxHeldFromOne) return false;
  if (held) held_from_[held->from] -= held->bytes;
  bytes += newer.bytes;
  held = std::move(newer);
  return true;
}

void Relay::pass_on(RobotId from, RobotId origin, std::size_t kind, double now_s) {
  for (const auto& [robot, neighbour] : direct_)
    if (robot != origin && robot != from && !links_.linked(robot, origin) &&
        !links_.linked(robot, from))
      send(robot, origin, kind, now_s);
}

void Relay::compare(const TeamStatus& status, double now_s) {
  const RobotId robot = status.sender.robot;
  Neighbour& neighbour = direct_.at(robot);
  if (status.holds == holds()) {
    neighbour.patience_s = period_s_;
    for (auto& [what, served] : neighbour.served) served.confirmed = true;
    return;
  }
  if (now_s < neighbour.repair_s) return;
  bool any = false;
  for (const auto& [other, origin] : origins_)
    for (std::size_t kind = 0; kind < kFlooded; ++kind) {
      const auto& held = origin.newest[kind];
      const bool receives_origin = other != self_.robot && links_.linked(robot, other);
      if (!held || other == robot || receives_origin || now_s - held->learned_s < period_s_)
        continue;
      const auto served = neighbour.served.find({other, kind});
      if (served != neighbour.served.end() && served->second.number == held->number &&
          (served->second.confirmed || now_s - served->second.sent_s < period_s_))
        continue;
      send(robot, other, kind, now_s);
      any = true;
    }
  if (!any) return;
  neighbour.repair_s = now_s + neighbour.patience_s;
  neighbour.patience_s = std::min(2.0 * neighbour.patience_s, kMaxPatience * period_s_);
}

std::optional<RobotId> Relay::next_hop(RobotId to, std::optional<RobotId> from) const {
  if (direct_.contains(to)) return to;
  const auto distances = links_.distances(to);
  std::optional<RobotId> next;
  std::size_t least = 0;
  for (const auto& [robot, neighbour] : direct_) {
    const auto distance = distances.find(robot);
    if (distance == distances.end() || robot == from || !links_.linked(self_.robot, robot))
      continue;
    if (next && least <= distance->second) continue;
    next = robot;
    least = distance->second;
  }
  return next;
}

Arrival Relay::route(RobotId from, const TeamMessagePtr& message) {
  const auto& reliable = std::get<ReliableMessage>(*message);
  if (reliable.sender.robot == self_.robot) return Arrival::kLost;
  if (!accepts(reliable.sender)) return Arrival::kRefused;
  if (reliable.to == self_.robot) return Arrival::kNew;
  const auto next = next_hop(reliable.to, from);
  if (!next) return Arrival::kLost;
  Passed& passed = passed_[{reliable.sender.robot, reliable.to}];
  if (passed.boot != reliable.sender.boot) passed = {reliable.sender.boot};
  const bool old =
      passed.copies.size() >= kRememberedCopies && reliable.copy < *passed.copies.begin();
  if (old || !passed.copies.insert(reliable.copy).second) return Arrival::kLost;
  if (passed.copies.size() > kRememberedCopies) passed.copies.erase(passed.copies.begin());
  packets_.push_back({*next, message});
  return Arrival::kPassedOn;
}

}  // namespace km
