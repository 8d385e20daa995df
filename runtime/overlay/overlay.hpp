#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "runtime/overlay/known_robots.hpp"
#include "runtime/overlay/message_store.hpp"
#include "runtime/overlay/overlay_message.hpp"
#include "runtime/overlay/spread_states.hpp"

namespace km {

/// Whether a message can reach one robot directly by DDS, over other robots, or both.
struct OverlayWays {
  bool direct = true;  ///< DDS delivers it now, or later to a robot that was received before.
  bool relay = false;

  bool operator==(const OverlayWays&) const = default;
};

/// Work that an Overlay requests.
struct OverlayOutput {
  std::vector<OverlayPacket> packets = {};        ///< Messages to send, in order.
  std::vector<OverlayMessagePtr> delivered = {};  ///< Messages for this robot, in order of arrival.
                                                  ///< Without signatures.
  std::vector<RobotIdentity> met = {};            ///< Robots that neighbours have introduced: new
                                                  ///< ones or new boot ids.
  std::vector<RobotId> reachable = {};            ///< Robots out of range to which a route has
                                                  ///< appeared.
  std::vector<RobotId> renewed = {};              ///< Robots that need new DDS writers.
};

/// The part of one robot in exchanging messages over any links of a team: robots need not receive
/// each other directly, now or ever. Protocols above it may assume that all robots of the team
/// receive each other, only late.
///
/// - KnownRobots: identities, keys, and the links between robots, which each robot reports as a
///   state;
/// - SpreadStates: states, of which the newest of each origin and stream counts;
/// - MessageStore: events, which all robots store, and calls to single robots.
///
/// Robots that receive each other directly exchange calls and events directly; the overlay carries
/// these messages for the others. If all robots receive each other, it forwards nothing.
///
/// Neighbours cannot change the state of this robot itself, or of robots that it receives directly.
/// In a team with keys the introduction of a robot contains its certificate, and the signature of
/// the origin stays with each message from its sender to its reader. Each robot checks signature
/// and certificate before it uses, stores or forwards a message. Neighbours can therefore withhold
/// messages, but not change or invent them.
///
/// A participant that forges the protocol of DDS can make a reader ignore a writer. In a team with
/// keys a robot therefore compares the hash of the states of each neighbour, which the neighbour's
/// status contains, with the states that have arrived. If packets are missing for kMissedAfter_s,
/// it reports so, and the neighbour renews its DDS writers.
///
/// Memory is bounded: see SpreadStates and MessageStore. Deterministic; time comes in [s], with any
/// origin, and does not decrease. Not thread-safe.
class Overlay {
 public:
  /// A neighbour is asked for new DDS writers after this time in which some of its packets are
  /// missing and none arrives. It is longer than the time between two repairs of states.
  static constexpr double kMissedAfter_s = 20.0;
  /// Least time between two renewals of the writers to one neighbour.
  static constexpr double kRenewEvery_s = 60.0;
  /// Least time between two reports of links: a robot that joins a large team meets its robots one
  /// after the other.
  static constexpr double kLinksPeriod_s = 0.5;

  /// Without `keys` nothing is signed. Messages are passed and delivered without signatures.
  explicit Overlay(TeamPeer self, std::optional<OverlayKeys> keys = {})
      : robots_(self, std::move(keys)),
        states_(robots_, output_.packets),
        store_(robots_, output_.packets) {}
  Overlay(const Overlay&) = delete;
  Overlay& operator=(const Overlay&) = delete;

  /// This robot receives `peer` directly from now on (connected), or no longer (lost).
  void connected(const RobotIdentity& peer, double now_s);
  void lost(RobotId robot, double now_s);
  /// Does the work that is due. Call it several times per second.
  void step(double now_s);

  /// Sends a state of this robot to all robots.
  void publish(OverlayStream stream, std::vector<std::uint8_t> content, double now_s) {
    states_.publish(stream, std::move(content), now_s);
  }
  /// Sends a message to one robot. False if there is no way to it, now or later: the message is
  /// dropped. For requests and replies, ways_to() reports whether DDS delivers them anyway.
  bool call(OverlayStream stream, RobotId to, std::uint32_t number,
            std::vector<std::uint8_t> content) {
    return store_.call(stream, to, number, std::move(content));
  }
  /// This robot has published a closure or an inlier set for `to`. If `to` is received directly,
  /// the message becomes a reliable message only if the link fails soon afterwards. If `to` is out
  /// of range, it becomes one at once; if `to` is unknown, this is decided at the first contact. A
  /// newer message of equal stream, `slot` and addressee replaces an older one. Only the
  /// incarnation of `to` receives it; with boot id 0, any incarnation.
  void wrote(OverlayStream stream, const TeamPeer& to, std::uint64_t slot,
             std::vector<std::uint8_t> content, double now_s) {
    store_.write(stream, to, slot, std::move(content), now_s);
  }

  /// Stores a bag that its origin has sent directly. The bag may arrive before connected() is
  /// called for the origin. In a team with keys, `content` ends with its signature.
  OverlayArrival keep_bag(const RobotIdentity& origin, std::uint32_t number,
                          std::vector<std::uint8_t> content);
  /// Stores a keyframe that a known robot has sent directly as a reply.
  OverlayArrival keep_reply(const TeamPeer& origin, std::uint32_t number,
                            std::vector<std::uint8_t> content);

  /// Processes a message that `from`, which is received directly, has sent. It may arrive before
  /// connected() is called for `from`.
  OverlayArrival receive(const RobotIdentity& from, const OverlayMessagePtr& message, double now_s);
  /// Processes the summary in the status of a neighbour.
  void update(RobotId neighbour, const OverlaySummary& summary, double now_s);
  /// Reason why the last message was kForged (a string literal).
  [[nodiscard]] const char* refusal() const { return robots_.refusal(); }

  [[nodiscard]] OverlaySummary summary() const;
  [[nodiscard]] const KnownRobots& robots() const { return robots_; }
  [[nodiscard]] OverlayWays ways_to(RobotId robot) const;
  /// Output since the last call.
  [[nodiscard]] OverlayOutput take_output() {
    return {std::exchange(output_.packets, {}), std::exchange(output_.delivered, {}),
            std::exchange(output_.met, {}), std::exchange(output_.reachable, {}),
            std::exchange(output_.renewed, {})};
  }
  /// Number of messages refused because the storage was full.
  [[nodiscard]] std::uint64_t given_up() const { return store_.given_up(); }
  /// Memory of the stored events and calls [bytes].
  [[nodiscard]] std::size_t memory_bytes() const { return store_.memory_bytes(); }

 private:
  bool meet(const RobotIdentity& peer);
  bool take_in(Meeting meeting, const TeamPeer& peer);
  void forget(RobotId robot);
  OverlayArrival introduce(const OverlayMessage& message, double now_s);
  OverlayArrival take_state(RobotId from, const OverlayMessagePtr& message, double now_s);
  OverlayArrival take_call(RobotId from, const OverlayMessagePtr& message);
  OverlayArrival take_event(const OverlayMessagePtr& message);
  [[nodiscard]] bool is_forged(const OverlayMessage& message);
  void deliver(const OverlayMessagePtr& message);
  void renew_routes();
  void watch_packets(RobotId robot, const OverlaySummary& summary, double now_s);

  KnownRobots robots_;
  OverlayOutput output_;
  SpreadStates states_;
  MessageStore store_;
  std::uint64_t links_version_ = 0;        // version of the links at the last step()
  std::vector<TeamPeer> published_links_;  // content of the last state kLinks
  double links_s_ = -1e9;                  // time of the last state kLinks
  std::set<RobotId> reachable_;            // robots out of range to which a route is known
};

/// Content of a state kLinks.
[[nodiscard]] std::vector<std::uint8_t> encode_links(const std::vector<TeamPeer>& links);
/// The robots, ascending; nullopt if the content is none that encode_links() writes.
[[nodiscard]] std::optional<std::vector<TeamPeer>> decode_links(
    std::span<const std::uint8_t> content);

}  // namespace km
