#include "modules/relay/relay_store.hpp"

#include <algorithm>
#include <memory>

namespace km {
namespace {

constexpr std::size_t kFilingBytes = 96;  // Bytes that the bookkeeping of one message takes.
constexpr std::uint8_t kMaxHops = 16;     // Hops before a message is dropped: outdated routes may
                                          // form a loop.
constexpr std::size_t kMaxUnmet = 10'000;

std::size_t bytes_of(const RelayMessage& message) {
  return message.content.size() + kFilingBytes;
}

}  // namespace

bool RelayStore::Stream::put(RelayMessage message, std::size_t max_bytes) {
  const std::size_t bytes = bytes_of(message);
  const auto known = messages_.find(message.number);
  const std::size_t freed = known == messages_.end() ? 0 : bytes_of(known->second);
  if (bytes_ - freed + bytes > max_bytes) return false;
  bytes_ += bytes - freed;
  const std::uint32_t number = message.number;
  messages_.insert_or_assign(number, std::move(message));
  while (messages_.contains(whole_)) ++whole_;
  return true;
}

const RelayMessage* RelayStore::Stream::find(std::uint32_t number) const {
  const auto found = messages_.find(number);
  return found == messages_.end() ? nullptr : &found->second;
}

std::optional<TeamPeer> RelayStore::origin(RobotId robot) const {
  const auto found = origins_.find(robot);
  if (found == origins_.end()) return std::nullopt;
  return TeamPeer{robot, found->second.identity.boot};
}

RelayStore::Origin* RelayStore::know(const RobotIdentity& identity) {
  const auto known = origins_.find(identity.robot);
  if (known == origins_.end() && origins_.size() >= kMaxOrigins) return nullptr;
  Origin& origin = origins_.try_emplace(identity.robot, Origin{.identity = identity}).first->second;
  const bool stays = origin.identity.boot == identity.boot && origin.membership.certificate;
  become(origin, identity, stays ? origin.membership : membership_of(identity));
  return &origin;
}

// Credentials and certificate of a process that this robot receives directly.
RelayStore::Membership RelayStore::membership_of(const RobotIdentity& identity) const {
  if (!keys_) return {};
  const auto credentials = keys_->credentials_of({identity.robot, identity.boot});
  if (!credentials) return {};
  return {*credentials, keys_->certified(identity, *credentials).value};
}

// True if this robot can attribute messages to this process. False after the keys of the process
// have been removed, even if it receives the process directly.
bool RelayStore::is_known(const TeamPeer& peer) const {
  return origin(peer.robot) == peer &&
         (!keys_ || origins_.at(peer.robot).membership.certificate.has_value());
}

// True if the known process that is stated as the origin has not signed the message, or if its
// certificate is revoked or not valid now. In the second case the origin is removed, unless it is
// received directly, so that neighbours stop sending its messages.
bool RelayStore::is_forged(const RelayMessage& message) {
  if (!keys_) return false;
  const RobotId robot = message.origin.robot;
  const Certificate& certificate = *origins_.at(robot).membership.certificate;
  refusal_ = keys_->why_lapsed(certificate);
  if (refusal_ != nullptr) {
    if (!receives(robot)) origins_.erase(robot);
    return true;
  }
  if (is_endorsed(message, certificate.key)) return false;
  refusal_ = "not signed by its origin, or changed on its way";
  return true;
}

void RelayStore::sign(RelayMessage& message) const {
  if (keys_) endorse(message, *keys_);
}

RelayWays RelayStore::ways_to(RobotId robot) const {
  const auto known = origins_.find(robot);
  if (known == origins_.end() || receives(robot)) return {};
  return {.direct = known->second.was_direct, .relay = true};
}

// A resumed process sends all its closures again, so its stored reliable messages are discarded.
// Messages that it signed with another key are discarded because no robot would accept them.
void RelayStore::become(Origin& origin, const RobotIdentity& identity, Membership membership) {
  const std::uint64_t former = origin.identity.boot;
  const auto key_of = [](const Membership& one) {
    return one.certificate ? one.certificate->key : PublicKey{};
  };
  const bool other_key = key_of(origin.membership) != key_of(membership);
  origin.identity = identity;
  origin.membership = std::move(membership);
  if (former == identity.boot) return;
  origin.reliable = {};
  const bool other_incarnation = !is_same_incarnation(former, identity.boot);
  if (other_key || other_incarnation) origin.bags = origin.replies = {};
  if (other_incarnation) drop_messages_to_former_incarnations({identity.robot, identity.boot});
}

void RelayStore::drop_messages_to_former_incarnations(const TeamPeer& peer) {
  const auto is_over = [&](const RelayMessage& message) {
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

void RelayStore::connected(const RobotIdentity& peer) {
  Origin* origin = peer.robot == self_.robot ? nullptr : know(peer);
  if (origin == nullptr) return;
  origin->via.reset();
  origin->was_direct = true;
  neighbours_[peer.robot] = {};
  settle_unmet(peer.robot, true);
  renew_ways();
}

void RelayStore::lost(RobotId robot, double now_s) {
  if (neighbours_.erase(robot) == 0) return;
  for (Recent& recent : std::exchange(recent_, {})) {
    if (now_s - recent.sent_s > kDoubt_s) continue;
    if (recent.message.to == robot) {
      add_reliable(recent.slot, std::move(recent.message));
    } else {
      recent_.push_back(std::move(recent));
    }
  }
  renew_ways();
}

RelayArrival RelayStore::keep_bag(const RobotIdentity& origin, std::uint32_t number,
                                  std::vector<std::uint8_t> content) {
  if (origin.robot == self_.robot) return RelayArrival::kRefused;
  if (know(origin) == nullptr) return RelayArrival::kNoRoom;
  RelayMessage bag{.kind = RelayKind::kBag,
                   .origin = {origin.robot, origin.boot},
                   .number = number,
                   .content = std::move(content)};
  if (!is_known(bag.origin)) return RelayArrival::kRefused;
  if (is_forged(bag)) return RelayArrival::kForged;
  return keep(&Origin::bags, kMaxBagBytes, std::move(bag));
}

RelayArrival RelayStore::keep_reply(const TeamPeer& from, std::uint32_t number,
                                    std::vector<std::uint8_t> content) {
  const auto known = origin(from.robot);
  if (!known || !is_same_incarnation(known->boot, from.boot)) return RelayArrival::kRefused;
  RelayMessage reply{
      .kind = RelayKind::kReply, .origin = *known, .number = number, .content = std::move(content)};
  if (!is_known(reply.origin)) return RelayArrival::kRefused;
  if (is_forged(reply)) return RelayArrival::kForged;
  hold_reply(std::move(reply));
  return RelayArrival::kNew;
}

void RelayStore::hold_reply(RelayMessage reply) {
  Stream& replies = origins_.at(reply.origin.robot).replies;
  // A reply contains only keypoints chosen for its requester, so the largest reply serves other
  // requesters best.
  const RelayMessage* before = replies.find(reply.number);
  if (before != nullptr && before->content.size() >= reply.content.size()) return;
  if (!has_room_for(reply) || !replies.put(std::move(reply), kMaxReplyBytes)) ++given_up_;
}

RelayArrival RelayStore::keep(Stream Origin::*stream, std::size_t max_bytes, RelayMessage message) {
  Stream& kept = origins_.at(message.origin.robot).*stream;
  if (kept.has(message.number)) return RelayArrival::kRepeated;
  if (kept.put(std::move(message), max_bytes)) return RelayArrival::kNew;
  ++given_up_;
  return RelayArrival::kNoRoom;
}

void RelayStore::wrote(RelayKind kind, const TeamPeer& to, std::uint64_t slot,
                       std::vector<std::uint8_t> content, double now_s) {
  RelayMessage message{.kind = kind,
                       .origin = self_,
                       .to = to.robot,
                       .to_boot = to.boot,
                       .content = std::move(content)};
  while (!recent_.empty() && now_s - recent_.front().sent_s > kDoubt_s) recent_.pop_front();
  if (receives(to.robot)) return recent_.push_back({now_s, slot, std::move(message)});
  if (origins_.contains(to.robot)) return add_reliable(slot, std::move(message));
  unmet_.push_back({now_s, slot, std::move(message)});
  if (unmet_.size() <= kMaxUnmet) return;
  unmet_.pop_back();
  ++given_up_;
}

// The messages to a robot that is received directly are already stored for it.
void RelayStore::settle_unmet(RobotId robot, bool direct) {
  for (Recent& unmet : std::exchange(unmet_, {})) {
    if (unmet.message.to != robot) {
      unmet_.push_back(std::move(unmet));
    } else if (!direct) {
      add_reliable(unmet.slot, std::move(unmet.message));
    }
  }
}

void RelayStore::add_reliable(std::uint64_t slot, RelayMessage message) {
  message.number = own_reliable_.whole();
  const auto [last, first] =
      own_slots_.try_emplace({message.kind, message.to, slot}, message.number);
  if (!first) empty_reliable(std::exchange(last->second, message.number));
  sign(message);
  if (own_reliable_.put(std::move(message), kMaxReliableBytes)) return;
  ++given_up_;
  own_slots_.erase(last);
}

// The number of the message stays in use, because messages are sent in the order of their numbers.
void RelayStore::empty_reliable(std::uint32_t number) {
  RelayMessage emptied = *own_reliable_.find(number);
  emptied.content.clear();
  sign(emptied);
  (void)own_reliable_.put(std::move(emptied), kMaxReliableBytes);  // Fits in place of the larger
                                                                   // message.
}

void RelayStore::call(RelayKind kind, RobotId to, std::uint32_t number,
                      std::vector<std::uint8_t> content) {
  RelayMessage message{
      .kind = kind, .origin = self_, .to = to, .number = number, .content = std::move(content)};
  // The requester repeats its request. DDS stores replies for a robot that it can reach later.
  if (!next_hop(to, {}) && (kind == RelayKind::kRequest || ways_to(to).direct)) return;
  sign(message);
  (void)route(std::move(message), {});
}

RelayArrival RelayStore::receive(const RelayPacket& packet) {
  const RelayMessage& message = *packet.message;
  const RobotId from = packet.neighbour;
  const RobotId robot = message.origin.robot;
  if (!receives(from) || robot == self_.robot) return RelayArrival::kRefused;
  if (message.kind == RelayKind::kIntroduction) return introduce(from, message);
  if (!is_known(message.origin)) return RelayArrival::kRefused;
  if (is_forged(message)) return RelayArrival::kForged;

  const bool is_kept = message.kind == RelayKind::kBag || is_reliable(message.kind);
  if (is_kept && !has_room_for(message)) {
    ++given_up_;
    return RelayArrival::kNoRoom;
  }
  const bool is_mine = message.to == self_.robot;
  RelayArrival arrival = RelayArrival::kNew;
  if (message.kind == RelayKind::kBag) {
    if (receives(robot)) return RelayArrival::kRepeated;
    arrival = keep(&Origin::bags, kMaxBagBytes, message);
    origins_.at(robot).via = from;
  } else if (is_reliable(message.kind)) {
    RelayMessage kept = message;
    // Only the addressee needs the content. With keys it is kept, because the signature covers it.
    if (is_mine && !keys_) kept.content = {};
    arrival = keep(&Origin::reliable, kMaxReliableBytes, std::move(kept));
  } else {
    if (message.kind == RelayKind::kReply) hold_reply(message);
    if (!is_mine) return route(message, from);
  }
  const bool is_this_incarnation =
      message.to_boot == 0 || is_same_incarnation(message.to_boot, self_.boot);
  const bool is_for_self = message.kind == RelayKind::kBag || (is_mine && is_this_incarnation);
  if (arrival == RelayArrival::kNew && is_for_self) deliver(packet.message);
  return arrival;
}

void RelayStore::deliver(const RelayMessagePtr& message) {
  if (message->content.size() <= tail_bytes()) return;
  if (!keys_) return output_.delivered.push_back(message);
  RelayMessage plain = *message;
  plain.content.erase(plain.content.end() - static_cast<std::ptrdiff_t>(tail_bytes()),
                      plain.content.end());
  output_.delivered.push_back(std::make_shared<const RelayMessage>(std::move(plain)));
}

bool RelayStore::has_room_for(const RelayMessage& message) const {
  if (receives(message.origin.robot)) return true;
  std::size_t bytes = bytes_of(message);
  for (const auto& [robot, origin] : origins_)
    if (!receives(robot))
      bytes += origin.bags.bytes() + origin.reliable.bytes() + origin.replies.bytes();
  return bytes <= kMaxFarBytes;
}

RelayArrival RelayStore::introduce(RobotId from, const RelayMessage& message) {
  const auto content = parse_introduction(message.content);
  if (!content || (!keys_ && !content->credentials.empty())) return RelayArrival::kRefused;
  const RobotIdentity identity{
      .robot = message.origin.robot, .name = content->name, .boot = message.origin.boot};
  if (receives(identity.robot)) return RelayArrival::kRepeated;
  const auto known = origins_.find(identity.robot);
  if (known == origins_.end()) {
    if (origins_.size() >= kMaxOrigins) return RelayArrival::kNoRoom;
  } else {
    Origin& origin = known->second;
    const bool knows_it = neighbours_.at(from).received.contains(identity.robot);
    if (origin.identity.boot == identity.boot) {
      if (knows_it || !origin.via || !receives(*origin.via)) origin.via = from;
      renew_ways();
      return RelayArrival::kRepeated;
    }
    if (!knows_it && origin.via != from) return RelayArrival::kRefused;
  }
  return meet(identity, content->credentials, from);
}

RelayArrival RelayStore::meet(const RobotIdentity& identity, const std::string& credentials,
                              RobotId from) {
  Membership membership{.credentials = credentials};
  if (keys_) {
    Decoded<Certificate> certified = keys_->certified(identity, credentials);
    refusal_ = certified.refusal;
    if (!certified.value) return RelayArrival::kForged;
    membership.certificate = std::move(certified.value);
  }
  const auto [entry, is_new] = origins_.try_emplace(identity.robot, Origin{.identity = identity});
  Origin& origin = entry->second;
  become(origin, identity, std::move(membership));
  origin.via = from;
  origin.reachable = false;
  if (is_new) settle_unmet(identity.robot, false);
  output_.met.push_back(identity);
  renew_ways();
  return RelayArrival::kNew;
}

void RelayStore::update(RobotId robot, const RelaySummary& summary, double now_s) {
  const auto found = neighbours_.find(robot);
  if (found == neighbours_.end()) return;
  Neighbour& neighbour = found->second;
  neighbour.received = {summary.received.begin(), summary.received.end()};
  neighbour.holds.clear();
  for (const RelayHeld& held : summary.holds) neighbour.holds[held.origin.robot] = held;
  renew_ways();
  if (neighbour.received.contains(self_.robot)) forward(robot, now_s);
}

void RelayStore::forward(RobotId to, double now_s) {
  Neighbour& neighbour = neighbours_.at(to);
  const auto own = neighbour.holds.find(self_.robot);
  const bool knows_own = own != neighbour.holds.end() && own->second.origin == self_;
  const Origin self{.identity = {.robot = self_.robot, .name = {}, .boot = self_.boot}};
  forward(to, self, true, knows_own ? own->second.reliable : 0, now_s);
  for (const auto& [robot, origin] : origins_) {
    if (robot == to) continue;
    if (neighbour.received.contains(robot)) {
      neighbour.misses_s.erase(robot);
      continue;
    }
    const double since_s = neighbour.misses_s.try_emplace(robot, now_s).first->second;
    if (now_s - since_s >= kGrace_s) forward(to, origin, now_s);
  }
}

void RelayStore::forward(RobotId to, const Origin& origin, double now_s) {
  Neighbour& neighbour = neighbours_.at(to);
  const TeamPeer peer{origin.identity.robot, origin.identity.boot};
  const auto held = neighbour.holds.find(peer.robot);
  if (held == neighbour.holds.end() || held->second.origin != peer) {
    const auto [introduced, first] = neighbour.introduced_s.try_emplace(peer.robot, now_s);
    if (!first && now_s - introduced->second < kPatience_s) return;
    introduced->second = now_s;
    if (keys_ && !origin.membership.certificate) return;  // No robot would accept it.
    return send(to, {.kind = RelayKind::kIntroduction,
                     .origin = peer,
                     .content = to_octets({origin.identity.name, origin.membership.credentials})});
  }
  forward(to, origin, false, held->second.bags, now_s);
  forward(to, origin, true, held->second.reliable, now_s);
}

// Sends the messages from the first one that the neighbour lacks, up to the window.
void RelayStore::forward(RobotId to, const Origin& origin, bool reliable, std::uint32_t reported,
                         double now_s) {
  Neighbour& neighbour = neighbours_.at(to);
  const TeamPeer peer{origin.identity.robot, origin.identity.boot};
  const bool is_own = peer == self_;
  const Stream& stream = is_own ? own_reliable_ : reliable ? origin.reliable : origin.bags;
  Progress& progress =
      neighbour.progress.try_emplace({peer.robot, reliable}, Progress{reported, reported, now_s})
          .first->second;
  const bool stands_still = reported == progress.reported && reported < stream.whole();
  if (!stands_still) progress.since_s = now_s;
  const bool overdue = now_s - progress.since_s >= kPatience_s;
  progress.sent =
      overdue || reported < progress.reported ? reported : std::max(reported, progress.sent);
  progress.reported = reported;
  if (!is_own && !overdue && another_should(to, neighbour.holds.at(peer.robot))) return;
  if (overdue) progress.since_s = now_s;

  std::size_t under_way = 0;
  for (std::uint32_t number = reported; number < progress.sent; ++number)
    if (const RelayMessage* sent = stream.find(number)) under_way += bytes_of(*sent);
  for (; progress.sent < stream.whole() && under_way < kWindowBytes; ++progress.sent) {
    RelayMessage message = *stream.find(progress.sent);
    message.origin = peer;  // Current boot id of the origin.
    under_way += bytes_of(message);
    send(to, std::move(message));
  }
}

// True if another robot has precedence in sending these messages to the neighbour. Candidates
// exchange messages with the neighbour directly. They also receive the origin directly or hold more
// of its messages. Candidates that receive the origin come first, then those with the lower id.
bool RelayStore::another_should(RobotId to, const RelayHeld& held) const {
  const RobotId origin = held.origin.robot;
  const Neighbour& neighbour = neighbours_.at(to);
  const std::pair own(!receives(origin), self_.robot);
  return std::ranges::any_of(neighbours_, [&](const auto& entry) {
    const auto& [robot, other] = entry;
    if (robot == to || !other.received.contains(to) || !neighbour.received.contains(robot))
      return false;
    const bool at_source = other.received.contains(origin);
    const auto its = other.holds.find(origin);
    const bool has_more = its != other.holds.end() && its->second.origin == held.origin &&
                          (its->second.bags > held.bags || its->second.reliable > held.reliable);
    return (at_source || has_more) && std::pair(!at_source, robot) < own;
  });
}

std::optional<RobotId> RelayStore::next_hop(RobotId to, std::optional<RobotId> from) const {
  if (receives(to)) return to;
  for (const auto& [robot, neighbour] : neighbours_)
    if (robot != from && neighbour.received.contains(to) &&
        neighbour.received.contains(self_.robot))
      return robot;
  const auto known = origins_.find(to);
  if (known == origins_.end() || !known->second.via || known->second.via == from ||
      !receives(*known->second.via))
    return std::nullopt;
  return known->second.via;
}

RelayArrival RelayStore::route(RelayMessage message, std::optional<RobotId> from) {
  if (from && message.hops >= kMaxHops) return RelayArrival::kRefused;
  message.hops = static_cast<std::uint8_t>(message.hops + (from ? 1 : 0));
  if (const auto next = next_hop(message.to, from)) {
    send(*next, std::move(message));
    return RelayArrival::kNew;
  }
  if (message.kind == RelayKind::kRequest && answer(message)) return RelayArrival::kNew;
  auto& waiting = carried_[message.to];
  const auto key = std::tuple(message.kind, message.origin.robot, message.number);
  const auto before = waiting.find(key);
  const std::size_t freed = before == waiting.end() ? 0 : bytes_of(before->second);
  if (carried_bytes_ - freed + bytes_of(message) > kMaxCarriedBytes) {
    ++given_up_;
    return RelayArrival::kNoRoom;
  }
  carried_bytes_ += bytes_of(message) - freed;
  waiting.insert_or_assign(key, std::move(message));
  return RelayArrival::kNew;
}

bool RelayStore::answer(const RelayMessage& request) {
  const auto asked = origins_.find(request.to);
  if (asked == origins_.end()) return false;
  const RelayMessage* kept = asked->second.replies.find(request.number);
  const auto next = next_hop(request.origin.robot, {});
  if (kept == nullptr || !next) return false;
  RelayMessage reply = *kept;
  reply.origin = *origin(request.to);
  reply.to = request.origin.robot;
  reply.hops = 0;
  send(*next, std::move(reply));
  return true;
}

void RelayStore::renew_ways() {
  for (auto& [robot, origin] : origins_) {
    const bool reachable = next_hop(robot, {}).has_value();
    const bool before = std::exchange(origin.reachable, reachable);
    if (reachable && !before && !receives(robot)) output_.reachable.push_back(robot);
  }
  for (auto entry = carried_.begin(); entry != carried_.end();) {
    const auto next = next_hop(entry->first, {});
    if (!next) {
      ++entry;
      continue;
    }
    for (auto& [key, message] : entry->second) {
      carried_bytes_ -= bytes_of(message);
      send(*next, std::move(message));
    }
    entry = carried_.erase(entry);
  }
}

RelaySummary RelayStore::summary() const {
  RelaySummary summary;
  for (const auto& [robot, neighbour] : neighbours_) summary.received.push_back(robot);
  for (const auto& [robot, origin] : origins_) {
    const std::uint32_t bags = receives(robot) ? 0 : origin.bags.whole();
    const std::uint32_t reliable = origin.reliable.whole();
    if (!receives(robot) || reliable > 0)
      summary.holds.push_back({{robot, origin.identity.boot}, bags, reliable});
  }
  return summary;
}

void RelayStore::send(RobotId neighbour, RelayMessage message) {
  output_.packets.push_back({neighbour, std::make_shared<const RelayMessage>(std::move(message))});
}

}  // namespace km
