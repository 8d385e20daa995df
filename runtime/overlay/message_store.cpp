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
  const std::uint32_t number = message.number;
  const std::size_t bytes = stored_bytes(message);
  const auto known = messages_.find(number);
  const std::size_t freed = known == messages_.end() ? 0 : stored_bytes(known->second);
  if (number < first_ || bytes > max_bytes) return false;
  for (auto oldest = messages_.begin(); bytes_ - freed + bytes > max_bytes;) {
    if (oldest->first >= number) return false;
    bytes_ -= stored_bytes(oldest->second);
    first_ = oldest->first + 1;
    oldest = messages_.erase(oldest);
  }
  bytes_ += bytes - freed;
  messages_.insert_or_assign(number, std::move(message));
  extend_whole(first_);
  return true;
}

void MessageStore::Numbered::extend_whole(std::uint32_t least) {
  whole_ = std::max(whole_, least);
  while (messages_.contains(whole_)) ++whole_;
}

void MessageStore::Numbered::skip_gap(double now_s) {
  const auto next = messages_.lower_bound(whole_);
  if (next == messages_.end()) return gap_.reset();
  if (std::exchange(gap_, whole_) != whole_) gap_since_s_ = now_s;
  if (now_s - gap_since_s_ >= kGapPatience_s) extend_whole(next->first);
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
  for (auto& [robot, held] : held_)
    for (Numbered* messages : {&held.bags, &held.reliable}) messages->skip_gap(now_s);
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
  drop_carried(peer.robot);
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
  const std::size_t room = is_direct ? kMaxFarBytes : room_for(robot);
  Held& held = held_[robot];
  const bool is_bag = !is_reliable(message.stream);
  Numbered& stored = is_bag ? held.bags : held.reliable;
  if (stored.has(message.number)) return OverlayArrival::kRepeated;
  OverlayMessage kept = message;
  // Only the addressee needs the content. With keys it is kept, because the signature covers it.
  if (!is_bag && message.to == robots_.self().robot && !robots_.has_keys()) kept.content = {};
  const std::size_t limit = is_bag ? kMaxBagBytes : kMaxReliableBytes;
  if (stored.put(std::move(kept), std::min(limit, stored.bytes() + room)))
    return OverlayArrival::kNew;
  ++given_up_;
  return OverlayArrival::kNoRoom;
}

// Bytes that further messages of a robot may take.
std::size_t MessageStore::room_for(RobotId origin) const {
  if (receives(origin)) return kMaxFarBytes;
  std::size_t bytes = 0;
  for (const auto& [robot, held] : held_)
    if (!receives(robot)) bytes += held.bytes();
  return kMaxFarBytes - std::min(bytes, kMaxFarBytes);
}

void MessageStore::hold_reply(OverlayMessage reply) {
  const std::size_t room = room_for(reply.origin.robot);
  Numbered& replies = held_[reply.origin.robot].replies;
  // A reply contains only keypoints chosen for its requester, so the largest reply serves other
  // requesters best.
  const OverlayMessage* before = replies.find(reply.number);
  if (before != nullptr && before->content.size() >= reply.content.size()) return;
  if (!replies.put(std::move(reply), std::min(kMaxReplyBytes, replies.bytes() + room))) ++given_up_;
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
  unmet_.pop_front();
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
  const std::tuple key(message.stream, message.to, slot);
  const std::uint32_t number = message.number = own_reliable_.whole();
  const std::uint32_t oldest = own_reliable_.first();
  robots_.sign(message);
  if (!own_reliable_.put(std::move(message), kMaxReliableBytes)) {
    ++given_up_;
    return;
  }
  if (own_reliable_.first() != oldest)
    std::erase_if(own_slots_,
                  [&](const auto& entry) { return entry.second < own_reliable_.first(); });
  const auto [former, is_first] = own_slots_.try_emplace(key, number);
  if (!is_first) empty_reliable(std::exchange(former->second, number));
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
  const std::uint32_t first = std::max(reported, messages.first());
  for (std::uint32_t number = first; number < progress.sent; ++number)
    if (const OverlayMessage* sent = messages.find(number)) under_way += stored_bytes(*sent);
  progress.sent = std::max(progress.sent, first);
  for (; progress.sent < messages.whole() && under_way < kWindowBytes; ++progress.sent) {
    const OverlayMessage* stored = messages.find(progress.sent);
    if (stored == nullptr) continue;
    OverlayMessage message = *stored;
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
  const std::size_t bytes = stored_bytes(message);
  if (bytes > kMaxCarriedBytes) {
    ++given_up_;
    return OverlayArrival::kNoRoom;
  }
  const std::tuple key(message.to, message.stream, message.origin.robot, message.number);
  const auto [entry, is_new] = carried_.try_emplace(key);
  if (!is_new) carried_bytes_ -= stored_bytes(entry->second.message);
  carried_bytes_ += bytes;
  entry->second = {++carried_count_, std::move(message)};
  for (; carried_bytes_ > kMaxCarriedBytes; ++given_up_) {
    const auto oldest = std::ranges::min_element(
        carried_, {}, [](const auto& carried) { return carried.second.count; });
    carried_bytes_ -= stored_bytes(oldest->second.message);
    carried_.erase(oldest);
  }
  return OverlayArrival::kNew;
}

void MessageStore::drop_carried(RobotId to) {
  std::erase_if(carried_, [&](const auto& entry) {
    const OverlayMessage& message = entry.second.message;
    if (message.to == to) carried_bytes_ -= stored_bytes(message);
    return message.to == to;
  });
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
  std::map<RobotId, std::optional<RobotId>> next_to;
  std::erase_if(carried_, [&](const auto& entry) {
    const OverlayMessage& message = entry.second.message;
    const auto [next, is_new] = next_to.try_emplace(message.to);
    if (is_new) next->second = robots_.next_hop(message.to);
    if (!next->second) return false;
    carried_bytes_ -= stored_bytes(message);
    send(*next->second, message);
    return true;
  });
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

std::size_t MessageStore::memory_bytes() const {
  std::size_t bytes = own_reliable_.bytes() + carried_bytes_;
  for (const auto& [robot, held] : held_) bytes += held.bytes();
  return bytes;
}

void MessageStore::send(RobotId neighbour, OverlayMessage message) {
  const bool is_own = message.origin == robots_.self();
  packets_.push_back(
      {neighbour, std::make_shared<const OverlayMessage>(std::move(message)), is_own});
}

}  // namespace km
