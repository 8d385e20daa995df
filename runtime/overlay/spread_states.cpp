#include "runtime/overlay/spread_states.hpp"

#include <algorithm>
#include <memory>

#include "modules/core/io/bytes.hpp"

namespace km {
namespace {

// Longest time between two repairs of one neighbour, as a multiple of kRepairAfter_s.
constexpr double kMaxPatience = 16.0;

}  // namespace

std::size_t SpreadStates::held_bytes(const Held& held) const {
  return held.from == robots_.self().robot ? 0 : stored_bytes(*held.message);
}

bool SpreadStates::may_forward(const Held& held) const {
  return held.from == robots_.self().robot || !robots_.has_keys() || held.message->is_signed;
}

void SpreadStates::publish(OverlayStream stream, std::vector<std::uint8_t> content, double now_s) {
  const TeamPeer& self = robots_.self();
  std::optional<Held>& held = origins_[self.robot][state_index(stream)];
  OverlayMessage message{.stream = stream,
                         .origin = self,
                         .number = held ? held->message->number + 1 : 0,
                         .content = std::move(content)};
  if (robots_.has_keys() && robots_.has_far()) robots_.sign(message);
  held = Held{std::make_shared<const OverlayMessage>(std::move(message)), now_s, self.robot};
  send_to_all({self.robot, state_index(stream)}, now_s);
}

void SpreadStates::send_to_all(const Key& key, double now_s) {
  for (const auto& [robot, receiver] : receivers_) send(robot, key, now_s);
}

void SpreadStates::send(RobotId next, const Key& key, double now_s) {
  const Held& held = *origins_.at(key.first)[key.second];
  if (key.first != robots_.self().robot)
    if (auto introduction = robots_.introduction(next, key.first, now_s))
      packets_.push_back({next, std::make_shared<const OverlayMessage>(std::move(*introduction))});
  if (!may_forward(held)) return;
  receivers_.at(next).served[key] = {held.message->number, now_s, false};
  packets_.push_back({next, held.message, key.first == robots_.self().robot});
}

bool SpreadStates::is_newer(const OverlayMessage& message) const {
  const auto origin = origins_.find(message.origin.robot);
  if (origin == origins_.end()) return true;
  const auto& held = origin->second[state_index(message.stream)];
  return !held || held->message->number < message.number;
}

OverlayArrival SpreadStates::arrive(RobotId from, const OverlayMessagePtr& message, double now_s) {
  const RobotId robot = message->origin.robot;
  const Key key{robot, state_index(message->stream)};
  std::optional<Held>& held = origins_[robot][key.second];
  const bool newer = is_newer(*message);
  const bool gains_signature = held && held->message->number == message->number &&
                               message->is_signed && !held->message->is_signed;
  if (newer || gains_signature)
    if (!hold(held, {message, now_s, from})) return OverlayArrival::kNoRoom;
  if (const auto receiver = receivers_.find(from); receiver != receivers_.end()) {
    Served& served = receiver->second.served[key];
    if (served.number <= message->number) served = {message->number, now_s, true};
  }
  if (newer || gains_signature) pass_on(from, key, now_s);
  return newer ? OverlayArrival::kNew : OverlayArrival::kRepeated;
}

// False if there is no room for `newer`.
bool SpreadStates::hold(std::optional<Held>& held, Held newer) {
  std::size_t& bytes = held_from_[newer.from];
  const std::size_t freed = held && held->from == newer.from ? held_bytes(*held) : 0;
  if (bytes - freed + held_bytes(newer) > kMaxHeldFromOne) return false;
  if (held) held_from_[held->from] -= held_bytes(*held);
  bytes += held_bytes(newer);
  held = std::move(newer);
  return true;
}

// True if the robots may soon receive each other: only one end has reported the link, or this robot
// receives both, and one of them only recently. If another robot has introduced the origin to this
// robot, that robot has already waited.
bool SpreadStates::may_be_linked(RobotId next, RobotId origin, double now_s) const {
  const auto from = receivers_.find(origin);
  const bool is_new = from != receivers_.end() &&
                      now_s - std::max(from->second.met_s, receivers_.at(next).met_s) < kMeeting_s;
  return is_new || links().receives(next, origin) || links().receives(origin, next);
}

void SpreadStates::pass_on(RobotId from, const Key& key, double now_s) {
  for (const auto& [robot, receiver] : receivers_)
    if (robot != from && !links().linked(robot, from)) offer(robot, key, now_s);
}

// Sends a state to a robot that does not receive its origin, later if it may soon do so. A robot
// that links connected to the origin a moment ago has the state.
void SpreadStates::offer(RobotId next, const Key& key, double now_s) {
  const RobotId origin = key.first;
  if (next == origin || links().linked(next, origin)) return;
  if (origin != robots_.self().robot && may_be_linked(next, origin, now_s))
    receivers_.at(next).due_s.try_emplace(key, now_s + kMeeting_s);
  else
    send(next, key, now_s);
}

void SpreadStates::connected(RobotId robot, double now_s) {
  receivers_[robot] = {.met_s = now_s, .repair_s = now_s + kRepairAfter_s};
  for (const auto& [origin, states] : origins_)
    for (std::size_t kind = 0; kind < kStateStreams; ++kind)
      if (states[kind]) offer(robot, {origin, kind}, now_s);
}

void SpreadStates::forget(RobotId robot) {
  const auto origin = origins_.find(robot);
  if (origin == origins_.end()) return;
  for (const auto& held : origin->second)
    if (held) held_from_[held->from] -= held_bytes(*held);
  origins_.erase(origin);
  const auto of_robot = [&](const auto& entry) { return entry.first.first == robot; };
  for (auto& [neighbour, receiver] : receivers_) {
    std::erase_if(receiver.served, of_robot);
    std::erase_if(receiver.due_s, of_robot);
  }
}

void SpreadStates::links_changed(double now_s) {
  for (const auto& [robot, receiver] : receivers_) {
    repair_soon(robot, now_s);
    if (receiver.differs) repair(robot, now_s);
  }
}

void SpreadStates::repair_soon(RobotId robot, double now_s) {
  Receiver& receiver = receivers_.at(robot);
  receiver.repair_s = std::min(receiver.repair_s, now_s);
  receiver.patience_s = kRepairAfter_s;
}

void SpreadStates::step(double now_s) {
  const RobotId self = robots_.self().robot;
  if (robots_.has_keys() && robots_.has_far())
    for (std::size_t kind = 0; kind < kStateStreams; ++kind) {
      std::optional<Held>& held = origins_[self][kind];
      if (!held || held->message->is_signed) continue;
      OverlayMessage message = *held->message;
      robots_.sign(message);
      held->message = std::make_shared<const OverlayMessage>(std::move(message));
      send_to_all({self, kind}, now_s);
    }
  for (auto& [robot, receiver] : receivers_)
    for (auto due = receiver.due_s.begin(); due != receiver.due_s.end();) {
      const Key key = due->first;
      if (due->second > now_s && may_be_linked(robot, key.first, now_s)) {
        ++due;
        continue;
      }
      due = receiver.due_s.erase(due);
      if (!links().linked(robot, key.first)) send(robot, key, now_s);
    }
}

void SpreadStates::compare(RobotId robot, std::uint64_t other_hash, double now_s) {
  Receiver& receiver = receivers_.at(robot);
  receiver.differs = other_hash != hash();
  if (receiver.differs) return repair(robot, now_s);
  receiver.patience_s = kRepairAfter_s;
  for (auto& [what, served] : receiver.served) served.confirmed = true;
}

// Sends the states that a neighbour may lack.
void SpreadStates::repair(RobotId robot, double now_s) {
  Receiver& receiver = receivers_.at(robot);
  if (now_s < receiver.repair_s) return;
  bool any = false;
  for (const auto& [origin, states] : origins_)
    for (std::size_t kind = 0; kind < kStateStreams; ++kind) {
      const auto& held = states[kind];
      const bool receives_origin = origin != robots_.self().robot && links().linked(robot, origin);
      if (!held || origin == robot || receives_origin || !may_forward(*held) ||
          receiver.due_s.contains({origin, kind}) || now_s - held->learned_s < kRepairAfter_s)
        continue;
      const auto served = receiver.served.find({origin, kind});
      if (served != receiver.served.end() && served->second.number == held->message->number &&
          (served->second.confirmed || now_s - served->second.sent_s < kRepairAfter_s))
        continue;
      send(robot, {origin, kind}, now_s);
      any = true;
    }
  if (!any) return;
  receiver.repair_s = now_s + receiver.patience_s;
  receiver.patience_s = std::min(2.0 * receiver.patience_s, kMaxPatience * kRepairAfter_s);
}

std::uint64_t SpreadStates::hash() const {
  std::uint64_t hash = kFnv1aBasis;
  for (const auto& [robot, states] : origins_) mix_fnv1a(hash, hash_of(robot));
  return hash;
}

std::uint64_t SpreadStates::hash_of(RobotId robot) const {
  std::uint64_t hash = kFnv1aBasis;
  const auto states = origins_.find(robot);
  if (states == origins_.end()) return hash;
  for (std::size_t kind = 0; kind < kStateStreams; ++kind) {
    if (!states->second[kind]) continue;
    const OverlayMessage& message = *states->second[kind]->message;
    for (const std::uint64_t value :
         {std::uint64_t{robot}, message.origin.boot, std::uint64_t{kind},
          2U * std::uint64_t{message.number} + (message.is_signed ? 1U : 0U)})
      mix_fnv1a(hash, value);
  }
  return hash;
}

}  // namespace km
