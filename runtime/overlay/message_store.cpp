#include "runtime/overlay/message_store.hpp"

#include <algorithm>
#include <memory>
#include <set>

namespace km {
namespace {

constexpr std::uint8_t kMaxHops = 16;  // Hops before a message is dropped: outdated routes may form
                                       // a loop.
constexpr std::size_t kMaxUnmet = 10'000;

}  // namespace

bool MessageStore::Numbered::put(OverlayMessage message, std::size_t max_bytes) {
  const std::size_t bytes = stored_bytes(message);
  const auto known = messages_.find(message.number);
  const std::size_t freed = known == messages_.end() ? 0 : stored_bytes(known->second);
  if (bytes_ - freed + bytes > max_bytes) return false;
  bytes_ += bytes - freed;
  const std::uint32_t number = message.number;
  messages_.insert_or_assign(number, std::move(message));
  while (messages_.contains(whole_)) ++whole_;
  return true;
}

const OverlayMessage* MessageStore::Numbered::find(std::uint32_t number) const {
  const auto found = messages_.find(number);
  return found == messages_.end() ? nullptr : &found->second;
}

// Messages of a robot, which may be this one.
const MessageStore::Numbered& MessageStore::messages_of(RobotId robot, bool reliable) const {
  static const Numbered kNone;
  if (robot == robots_.self().robot) return reliable ? own_reliable_ : kNone;
  const auto held = held_.find(robot);
  if (held == held_.end()) return kNone;
  return reliable ? held->second.reliable : held->second.bags;
}

void MessageStore::connected(RobotId robot) {
  receivers_[robot] = {};
  introduced_s_.erase(robot);
  settle_unmet(robot, true);
}

// True if a robot is known long enough to be out of range if it is not received directly.
bool MessageStore::is_met(RobotId robot, double now_s) const {
  const auto introduced = introduced_s_.find(robot);
  return robots_.process(robot) &&
         (introduced == introduced_s_.end() || now_s - introduced->second >= kGrace_s);
}

void MessageStore::step(double now_s) {
  std::set<RobotId> met;
  for (const Recent& unmet : unmet_)
    if (is_met(unmet.message.to, now_s)) met.insert(unmet.message.to);
  for (const RobotId robot : met) settle_unmet(robot, false);
}

void MessageStore::disconnected(RobotId robot, double now_s) {
  receivers_.erase(robot);
  for (Recent& recent : std::exchange(recent_, {})) {
    if (now_s - recent.sent_s > kDoubt_s) continue;
    if (recent.message.to == robot) {
      add_reliable(recent.slot, std::move(recent.message));
    } else {
      recent_.push_back(std::move(recent));
    }
  }
}

void MessageStore::forget_content(const TeamPeer& peer) {
  held_.erase(peer.robot);
  drop_messages_to_former_incarnations(peer);
}

void MessageStore::drop_messages_to_former_incarnations(const TeamPeer& peer) {
  const auto is_over = [&](const OverlayMessage& message) {
    return message.to == peer.robot && message.to_boot != 0 &&
           !is_same_incarnation(message.to_boot, peer.boot);
  };
  std::erase_if(recent_, [&](const Recent& recent) { return is_over(recent.message); });
  std::erase_if(own_slots_, [&](const auto& slot) {
    const bool ends = is_over(*own_reliable_.find(slot.second));
    if (ends) empty_reliable(slot.second);
    return ends;
  });
}

OverlayArrival MessageStore::arrive(const OverlayMessage& message, bool is_direct) {
  const RobotId robot = message.origin.robot;
  if (!is_direct && !has_room_for(message)) {
    ++given_up_;
    return OverlayArrival::kNoRoom;
  }
  Held& held = held_[robot];
  if (!is_reliable(message.stream)) return keep(held.bags, kMaxBagBytes, message);
  OverlayMessage kept = message;
  // Only the addressee needs the content. With keys it is kept, because the signature covers it.
  if (message.to == robots_.self().robot && !robots_.has_keys()) kept.content = {};
  return keep(held.reliable, kMaxReliableBytes, std::move(kept));
}

OverlayArrival MessageStore::keep(Numbered& kept, std::size_t max_bytes, OverlayMessage message) {
  if (kept.has(message.number)) return OverlayArrival::kRepeated;
  if (kept.put(std::move(message), max_bytes)) return OverlayArrival::kNew;
  ++given_up_;
  return OverlayArrival::kNoRoom;
}

bool MessageStore::has_room_for(const OverlayMessage& message) const {
  if (receives(message.origin.robot)) return true;
  std::size_t bytes = stored_bytes(message);
  for (const auto& [robot, held] : held_)
    if (!receives(robot)) bytes += held.bags.bytes() + held.reliable.bytes() + held.replies.bytes();
  return bytes <= kMaxFarBytes;
}

void MessageStore::hold_reply(OverlayMessage reply) {
  Numbered& replies = held_[reply.origin.robot].replies;
  // A reply contains only keypoints chosen for its requester, so the largest reply serves other
  // requesters best.
  const OverlayMessage* before = replies.find(reply.number);
  if (before != nullptr && before->content.size() >= reply.content.size()) return;
  if (!has_room_for(reply) || !replies.put(std::move(reply), kMaxReplyBytes)) ++given_up_;
}

void MessageStore::write(OverlayStream stream, const TeamPeer& to, std::uint64_t slot,
                         std::vector<std::uint8_t> content, double now_s) {
  OverlayMessage message{.stream = stream,
                         .origin = robots_.self(),
                         .to = to.robot,
                         .to_boot = to.boot,
                         .content = std::move(content)};
  while (!recent_.empty() && now_s - recent_.front().sent_s > kDoubt_s) recent_.pop_front();
  if (receives(to.robot)) return recent_.push_back({now_s, slot, std::move(message)});
  if (is_met(to.robot, now_s)) return add_reliable(slot, std::move(message));
  unmet_.push_back({now_s, slot, std::move(message)});
  if (unmet_.size() <= kMaxUnmet) return;
  unmet_.pop_back();
  ++given_up_;
}

// The messages to a robot that is received directly are already stored for it.
void MessageStore::settle_unmet(RobotId robot, bool direct) {
  for (Recent& unmet : std::exchange(unmet_, {})) {
    if (unmet.message.to != robot) {
      unmet_.push_back(std::move(unmet));
    } else if (!direct) {
      add_reliable(unmet.slot, std::move(unmet.message));
    }
  }
}

void MessageStore::add_reliable(std::uint64_t slot, OverlayMessage message) {
  message.number = own_reliable_.whole();
  const auto [last, first] =
      own_slots_.try_emplace({message.stream, message.to, slot}, message.number);
  if (!first) empty_reliable(std::exchange(last->second, message.number));
  robots_.sign(message);
  if (own_reliable_.put(std::move(message), kMaxReliableBytes)) return;
  ++given_up_;
  own_slots_.erase(last);
}

// The number of the message stays in use, because messages are sent in the order of their numbers.
void MessageStore::empty_reliable(std::uint32_t number) {
  OverlayMessage emptied = *own_reliable_.find(number);
  emptied.content.clear();
  robots_.sign(emptied);
  (void)own_reliable_.put(std::move(emptied), kMaxReliableBytes);  // Fits in place of the larger
                                                                   // message.
}

void MessageStore::forward(RobotId to, double now_s) {
  const TeamPeer& self = robots_.self();
  const auto& holds = robots_.neighbours().at(to).holds;
  const auto own = holds.find(self.robot);
  const bool knows_own = own != holds.end() && own->second.origin == self;
  forward(to, self, true, knows_own ? own->second.reliable : 0, now_s);
  Receiver& receiver = receivers_.at(to);
  for (const auto& [robot, known] : robots_.all()) {
    if (robot == to) continue;
    if (robots_.links().receives(to, robot)) {
      // A lost link is reported only after kLinkPatience_s.
      receiver.misses_s[robot] = now_s - KnownRobots::kLinkPatience_s;
      continue;
    }
    const double since_s = receiver.misses_s.try_emplace(robot, now_s).first->second;
    if (now_s - since_s >= kGrace_s) forward(to, {robot, known.identity.boot}, now_s);
  }
}

void MessageStore::forward(RobotId to, const TeamPeer& origin, double now_s) {
  const auto& holds = robots_.neighbours().at(to).holds;
  const auto held = holds.find(origin.robot);
  if (held == holds.end() || held->second.origin != origin) {
    if (auto introduction = robots_.introduction(to, origin.robot, now_s))
      send(to, std::move(*introduction));
    return;
  }
  forward(to, origin, false, held->second.bags, now_s);
  forward(to, origin, true, held->second.reliable, now_s);
}

// Sends the messages from the first one that the neighbour lacks, up to the window.
void MessageStore::forward(RobotId to, const TeamPeer& origin, bool reliable,
                           std::uint32_t reported, double now_s) {
  const bool is_own = origin == robots_.self();
  const Numbered& messages = messages_of(origin.robot, reliable);
  Progress& progress =
      receivers_.at(to)
          .progress.try_emplace({origin.robot, reliable}, Progress{reported, reported, now_s})
          .first->second;
  const bool stands_still = reported == progress.reported && reported < messages.whole();
  if (!stands_still) progress.since_s = now_s;
  const bool overdue = now_s - progress.since_s >= kPatience_s;
  progress.sent =
      overdue || reported < progress.reported ? reported : std::max(reported, progress.sent);
  progress.reported = reported;
  if (!is_own && !overdue && another_should(to, robots_.neighbours().at(to).holds.at(origin.robot)))
    return;
  if (overdue) progress.since_s = now_s;

  std::size_t under_way = 0;
  for (std::uint32_t number = reported; number < progress.sent; ++number)
    if (const OverlayMessage* sent = messages.find(number)) under_way += stored_bytes(*sent);
  for (; progress.sent < messages.whole() && under_way < kWindowBytes; ++progress.sent) {
    OverlayMessage message = *messages.find(progress.sent);
    message.origin = origin;  // Current boot id of the origin.
    under_way += stored_bytes(message);
    send(to, std::move(message));
  }
}

// True if another robot has precedence in sending these messages to the neighbour. Candidates
// exchange messages with the neighbour directly. They also receive the origin directly or hold more
// of its messages. Candidates that receive the origin come first, then those with the lower id.
bool MessageStore::another_should(RobotId to, const OverlayHeld& held) const {
  const RobotId origin = held.origin.robot;
  const TeamLinks& links = robots_.links();
  const std::pair own(!receives(origin), robots_.self().robot);
  return std::ranges::any_of(robots_.neighbours(), [&](const auto& entry) {
    const auto& [robot, other] = entry;
    if (robot == to || !links.linked(robot, to)) return false;
    const bool at_source = links.receives(robot, origin);
    const auto its = other.holds.find(origin);
    const bool has_more = its != other.holds.end() && its->second.origin == held.origin &&
                          (its->second.bags > held.bags || its->second.reliable > held.reliable);
    return (at_source || has_more) && std::pair(!at_source, robot) < own;
  });
}

bool MessageStore::call(OverlayStream stream, RobotId to, std::uint32_t number,
                        std::vector<std::uint8_t> content) {
  const auto next = robots_.next_hop(to);
  if (!next) {
    const bool is_stored_by_dds =
        receives(to) || !robots_.process(to) || robots_.all().at(to).was_direct;
    // Solvers and requesters repeat their messages. DDS stores replies for a robot that it can
    // reach later.
    if (stream != OverlayStream::kReply || is_stored_by_dds) return false;
  }
  OverlayMessage message{.stream = stream,
                         .origin = robots_.self(),
                         .to = to,
                         .number = number,
                         .content = std::move(content)};
  if (next != to) robots_.sign(message);
  (void)route(std::move(message), {});
  return true;
}

OverlayArrival MessageStore::route(OverlayMessage message, std::optional<RobotId> from) {
  if (from && message.hops >= kMaxHops) return OverlayArrival::kRefused;
  message.hops = static_cast<std::uint8_t>(message.hops + (from ? 1 : 0));
  if (const auto next = robots_.next_hop(message.to, from)) {
    send(*next, std::move(message));
    return OverlayArrival::kNew;
  }
  if (message.stream == OverlayStream::kSolver) return OverlayArrival::kNew;  // Sent again.
  if (message.stream == OverlayStream::kRequest && answer(message)) return OverlayArrival::kNew;
  return carry(std::move(message));
}

OverlayArrival MessageStore::carry(OverlayMessage message) {
  auto& waiting = carried_[message.to];
  const auto key = std::tuple(message.stream, message.origin.robot, message.number);
  const auto before = waiting.find(key);
  const std::size_t freed = before == waiting.end() ? 0 : stored_bytes(before->second);
  if (carried_bytes_ - freed + stored_bytes(message) > kMaxCarriedBytes) {
    ++given_up_;
    return OverlayArrival::kNoRoom;
  }
  carried_bytes_ += stored_bytes(message) - freed;
  waiting.insert_or_assign(key, std::move(message));
  return OverlayArrival::kNew;
}

bool MessageStore::answer(const OverlayMessage& request) {
  const auto asked = held_.find(request.to);
  if (asked == held_.end()) return false;
  const OverlayMessage* kept = asked->second.replies.find(request.number);
  const auto next = robots_.next_hop(request.origin.robot);
  if (kept == nullptr || !next) return false;
  OverlayMessage reply = *kept;
  reply.origin = *robots_.process(request.to);
  reply.to = request.origin.robot;
  reply.hops = 0;
  send(*next, std::move(reply));
  return true;
}

void MessageStore::renew_routes() {
  for (auto entry = carried_.begin(); entry != carried_.end();) {
    const auto next = robots_.next_hop(entry->first);
    if (!next) {
      ++entry;
      continue;
    }
    for (auto& [key, message] : entry->second) {
      carried_bytes_ -= stored_bytes(message);
      send(*next, std::move(message));
    }
    entry = carried_.erase(entry);
  }
}

std::vector<OverlayHeld> MessageStore::holds() const {
  std::vector<OverlayHeld> holds;
  for (const auto& [robot, known] : robots_.all()) {
    const std::uint32_t bags = receives(robot) ? 0 : messages_of(robot, false).whole();
    const std::uint32_t reliable = messages_of(robot, true).whole();
    if (!receives(robot) || reliable > 0)
      holds.push_back({{robot, known.identity.boot}, bags, reliable});
  }
  return holds;
}

void MessageStore::send(RobotId neighbour, OverlayMessage message) {
  const bool is_own = message.origin == robots_.self();
  packets_.push_back(
      {neighbour, std::make_shared<const OverlayMessage>(std::move(message)), is_own});
}

}  // namespace km
