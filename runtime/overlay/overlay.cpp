#include "runtime/overlay/overlay.hpp"

#include <algorithm>
#include <iterator>
#include <memory>

#include "modules/core/io/bytes.hpp"

namespace km {
namespace {

std::size_t tail_bytes(const OverlayMessage& message) {
  return message.is_signed ? kEndorsementBytes : 0;
}

std::span<const std::uint8_t> content_of(const OverlayMessage& message) {
  const std::span content(message.content);
  return content.first(content.size() - std::min(content.size(), tail_bytes(message)));
}

}  // namespace

std::vector<std::uint8_t> encode_links(const std::vector<TeamPeer>& links) {
  ByteWriter out;
  for (const TeamPeer& peer : links) {
    out.varint(peer.robot);
    out.u64(peer.boot);
  }
  return out.release();
}

std::optional<std::vector<TeamPeer>> decode_links(std::span<const std::uint8_t> content) {
  ByteReader in(content);
  std::vector<TeamPeer> links;
  while (in.left() > 0 && links.size() <= kMaxTeam) {
    const auto robot = in.varint_as<RobotId>();
    links.push_back({robot, in.u64()});
  }
  const auto ascends = [](const TeamPeer& a, const TeamPeer& b) { return a.robot >= b.robot; };
  if (!in.done() || links.size() > kMaxTeam ||
      std::ranges::adjacent_find(links, ascends) != links.end())
    return std::nullopt;
  return links;
}

void Overlay::connected(const RobotIdentity& peer, double now_s) {
  if (peer.robot == robots_.self().robot || !meet(peer)) return;
  robots_.connect(peer.robot);
  robots_.neighbours().at(peer.robot).complete_s = now_s;
  store_.connected(peer.robot);
  states_.connected(peer.robot, now_s);
  renew_routes();
}

void Overlay::lost(RobotId robot, double now_s) {
  if (!robots_.disconnect(robot, now_s)) return;
  states_.disconnected(robot);
  store_.disconnected(robot, now_s);
  if (robots_.has_lapsed(robot)) return forget(robot);
  renew_routes();
}

// Registers a process that is received directly. If there is no room, it takes the place of a robot
// that neighbours have introduced, because they could have invented that robot, or of a lost one.
bool Overlay::meet(const RobotIdentity& peer) {
  const TeamPeer process{peer.robot, peer.boot};
  if (take_in(robots_.meet(peer), process)) return true;
  const auto replaced = robots_.replaceable();
  if (!replaced) return false;
  forget(*replaced);
  return take_in(robots_.meet(peer), process);
}

void Overlay::forget(RobotId robot) {
  robots_.forget(robot);
  states_.forget(robot);
  store_.forget(robot);
  renew_routes();
}

// Discards messages of a former process of a robot. False if there is no room for the robot.
bool Overlay::take_in(Meeting meeting, const TeamPeer& peer) {
  switch (meeting) {
    case Meeting::kNoRoom:
      return false;
    case Meeting::kKnown:
    case Meeting::kNew:
      return true;
    case Meeting::kOtherContent:
      store_.forget_content(peer);
      break;
    case Meeting::kOtherProcess:
      store_.forget_process(peer.robot);
      break;
  }
  states_.forget(peer.robot);
  reachable_.erase(peer.robot);
  return true;
}

void Overlay::step(double now_s) {
  robots_.expire(now_s);
  std::vector<TeamPeer> links = robots_.own_links();
  if (links != published_links_ && now_s - links_s_ >= kLinksPeriod_s) {
    links_s_ = now_s;
    published_links_ = std::move(links);
    publish(OverlayStream::kLinks, encode_links(published_links_), now_s);
  }
  if (std::exchange(links_version_, robots_.links_version()) != robots_.links_version()) {
    renew_routes();
    states_.links_changed(now_s);
  }
  states_.step(now_s);
  store_.step(now_s);
}

OverlayArrival Overlay::keep_bag(const RobotIdentity& origin, std::uint32_t number,
                                 std::vector<std::uint8_t> content) {
  if (origin.robot == robots_.self().robot) return OverlayArrival::kRefused;
  const TeamPeer process{origin.robot, origin.boot};
  if (!meet(origin)) return OverlayArrival::kNoRoom;
  const OverlayMessage bag{.stream = OverlayStream::kBag,
                           .origin = process,
                           .number = number,
                           .is_signed = robots_.has_keys(),
                           .content = std::move(content)};
  if (!robots_.is_known(process)) return OverlayArrival::kRefused;
  if (is_forged(bag)) return OverlayArrival::kForged;
  return store_.arrive(bag, true);
}

OverlayArrival Overlay::keep_reply(const TeamPeer& from, std::uint32_t number,
                                   std::vector<std::uint8_t> content) {
  const auto known = robots_.process(from.robot);
  if (!known || !is_same_incarnation(known->boot, from.boot)) return OverlayArrival::kRefused;
  OverlayMessage reply{.stream = OverlayStream::kReply,
                       .origin = *known,
                       .number = number,
                       .is_signed = robots_.has_keys(),
                       .content = std::move(content)};
  if (!robots_.is_known(*known)) return OverlayArrival::kRefused;
  if (is_forged(reply)) return OverlayArrival::kForged;
  store_.hold_reply(std::move(reply));
  return OverlayArrival::kNew;
}

OverlayArrival Overlay::receive(const RobotIdentity& from, const OverlayMessagePtr& message,
                                double now_s) {
  const TeamPeer& origin = message->origin;
  if (const auto neighbour = robots_.neighbours().find(from.robot);
      neighbour != robots_.neighbours().end())
    neighbour->second.complete_s = now_s;
  if (origin.robot == robots_.self().robot)
    return is_state(message->stream) ? OverlayArrival::kRepeated : OverlayArrival::kRefused;
  if (message->stream == OverlayStream::kIntroduction) return introduce(*message, now_s);
  const bool is_direct = TeamPeer{from.robot, from.boot} == origin;
  if (is_direct && !robots_.is_known(origin) && !robots_.receives(origin.robot) && !meet(from))
    return OverlayArrival::kNoRoom;
  if (!robots_.is_known(origin)) return OverlayArrival::kRefused;
  // Bags and reliable messages are always signed.
  const bool needs_signature =
      !is_direct || !(is_state(message->stream) || is_call(message->stream));
  if ((needs_signature || message->is_signed) && is_forged(*message))
    return OverlayArrival::kForged;
  if (is_state(message->stream)) return take_state(from.robot, message, now_s);
  if (is_call(message->stream)) return take_call(from.robot, message);
  return take_event(message);
}

// True if the known process that is stated as the origin has not signed the message, or if its
// certificate is not valid any more. In the second case the origin is removed, unless it is
// received directly, so that neighbours stop sending its messages.
bool Overlay::is_forged(const OverlayMessage& message) {
  const RobotId robot = message.origin.robot;
  const Proof proof = robots_.check(message);
  if (proof == Proof::kLapsed && !robots_.receives(robot)) forget(robot);
  return proof != Proof::kValid;
}

OverlayArrival Overlay::introduce(const OverlayMessage& message, double now_s) {
  const KnownRobots::Introduced introduced = robots_.introduce(message);
  if (introduced.arrival != OverlayArrival::kNew) return introduced.arrival;
  (void)take_in(introduced.meeting, message.origin);  // There is room.
  if (introduced.meeting == Meeting::kNew) store_.introduced(message.origin.robot, now_s);
  output_.met.push_back(introduced.identity);
  renew_routes();
  return OverlayArrival::kNew;
}

OverlayArrival Overlay::take_state(RobotId from, const OverlayMessagePtr& message, double now_s) {
  const bool is_links = message->stream == OverlayStream::kLinks;
  auto links = is_links ? decode_links(content_of(*message)) : std::nullopt;
  if (is_links && !links) return OverlayArrival::kRefused;
  // The report decides to which robots it is forwarded. step() renews the routes.
  if (is_links && states_.is_newer(*message))
    robots_.report(message->origin.robot, std::move(*links));
  const OverlayArrival arrival = states_.arrive(from, message, now_s);
  if (arrival == OverlayArrival::kNew && !is_links) deliver(message);
  return arrival;
}

OverlayArrival Overlay::take_call(RobotId from, const OverlayMessagePtr& message) {
  const bool is_lasting = message->is_signed || !robots_.has_keys();
  if (message->stream == OverlayStream::kReply && is_lasting) store_.hold_reply(*message);
  if (message->to != robots_.self().robot) return store_.route(*message, from);
  deliver(message);
  return OverlayArrival::kNew;
}

OverlayArrival Overlay::take_event(const OverlayMessagePtr& message) {
  const bool is_bag = message->stream == OverlayStream::kBag;
  if (is_bag && robots_.receives(message->origin.robot)) return OverlayArrival::kRepeated;
  const OverlayArrival arrival = store_.arrive(*message, false);
  const TeamPeer& self = robots_.self();
  const bool is_mine = message->to == self.robot &&
                       (message->to_boot == 0 || is_same_incarnation(message->to_boot, self.boot));
  if (arrival == OverlayArrival::kNew && (is_bag || is_mine)) deliver(message);
  return arrival;
}

void Overlay::deliver(const OverlayMessagePtr& message) {
  if (content_of(*message).empty()) return;
  if (!message->is_signed) return output_.delivered.push_back(message);
  OverlayMessage plain = *message;
  plain.is_signed = false;
  plain.content.resize(content_of(*message).size());
  output_.delivered.push_back(std::make_shared<const OverlayMessage>(std::move(plain)));
}

OverlayWays Overlay::ways_to(RobotId robot) const {
  const auto known = robots_.all().find(robot);
  if (known == robots_.all().end() || robots_.receives(robot)) return {};
  return {.direct = known->second.was_direct, .relay = true};
}

void Overlay::update(RobotId robot, const OverlaySummary& summary, double now_s) {
  const auto found = robots_.neighbours().find(robot);
  if (found == robots_.neighbours().end()) return;
  found->second.holds.clear();
  for (const OverlayHeld& held : summary.holds) found->second.holds[held.origin.robot] = held;
  if (robots_.has_keys()) watch_packets(robot, summary, now_s);
  states_.compare(robot, summary.states, now_s);
  if (robots_.links().receives(robot, robots_.self().robot)) store_.forward(robot, now_s);
}

// Detects packets of a neighbour that do not arrive, and those of this robot that do not arrive
// there.
void Overlay::watch_packets(RobotId robot, const OverlaySummary& summary, double now_s) {
  KnownRobots::Neighbour& neighbour = robots_.neighbours().at(robot);
  if (summary.own_states == states_.hash_of(robot)) neighbour.complete_s = now_s;
  neighbour.is_missed = now_s - neighbour.complete_s >= kMissedAfter_s;
  const bool misses_own =
      std::ranges::find(summary.missed, robots_.self().robot) != summary.missed.end();
  if (!misses_own || now_s - neighbour.renewed_s < kRenewEvery_s) return;
  neighbour.renewed_s = now_s;
  output_.renewed.push_back(robot);
  states_.repair_soon(robot, now_s);
}

OverlaySummary Overlay::summary() const {
  OverlaySummary summary{.states = states_.hash(),
                         .holds = store_.holds(),
                         .own_states = states_.hash_of(robots_.self().robot)};
  for (const auto& [robot, neighbour] : robots_.neighbours())
    if (neighbour.is_missed) summary.missed.push_back(robot);
  return summary;
}

void Overlay::renew_routes() {
  const std::set<RobotId> connected = robots_.links().component(robots_.self().robot);
  std::set<RobotId> reachable;
  for (const auto& [robot, known] : robots_.all())
    if (!robots_.receives(robot) && connected.contains(robot) && robots_.next_hop(robot))
      reachable.insert(robot);
  std::ranges::set_difference(reachable, reachable_, std::back_inserter(output_.reachable));
  reachable_ = std::move(reachable);
  store_.renew_routes();
}

}  // namespace km
