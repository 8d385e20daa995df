#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "modules/core/relay_summary.hpp"
#include "modules/core/robot_identity.hpp"
#include "modules/relay/relay_endorsement.hpp"
#include "modules/relay/relay_message.hpp"

namespace km {

/// Result for a message that a neighbour has sent.
enum class [[nodiscard]] RelayArrival{
    kNew,       ///< Message to deliver, to forward or to store.
    kRepeated,  ///< The message is already known, or its origin is received directly.
    kRefused,   ///< The boot id of its origin is unknown, the origin is this robot, or the sender
                ///< is not a neighbour.
    kForged,    ///< Its origin has not signed it or is not a member; see RelayStore::refusal().
    kNoRoom,    ///< Dropped because the storage of its origin or of messages in transit is full.
};

/// Whether a message can reach one robot directly by DDS, over the relay, or both.
struct RelayWays {
  bool direct = true;  ///< DDS delivers it now, or later to a robot that was received before.
  bool relay = false;

  bool operator==(const RelayWays&) const = default;
};

/// Work that a RelayStore requests.
struct RelayOutput {
  std::vector<RelayPacket> packets;        ///< Messages to send.
  std::vector<RelayMessagePtr> delivered;  ///< Messages for this robot, in order of arrival.
  std::vector<RobotIdentity> met;          ///< Robots that neighbours have introduced: new ones or
                                           ///< new boot ids.
  std::vector<RobotId> reachable;          ///< Robots out of range to which a route has appeared.
};

/// Relay of one robot for messages outside the pose graph: it carries them between robots that do
/// not receive each other directly, now or ever. Every robot
///
/// - stores messages of each other robot (the origin): its bags of words, and its reliable
///   messages, which are closures and inlier sets for a robot out of its range;
/// - reports in its status which robots it receives directly, and how many messages of the other
///   robots it holds (RelaySummary). When a neighbour reports less, it sends the missing messages
///   in order, one window at a time, and repeats them if they do not arrive. If several robots
///   could send them, one that receives the origin directly does;
/// - forwards requests for keyframes and replies, to the addressee, to a neighbour of the
///   addressee, or back along the route of the addressee's bags. Without a route it replies with
///   its stored copy of the keyframe. If it has no copy it keeps the request until a route appears.
///
/// If all robots receive each other directly all the time, the relay sends nothing. A robot becomes
/// known when it is received directly or when a neighbour introduces it. A new boot id of a known
/// robot is accepted only from the neighbour that introduced it before and from robots that receive
/// it directly. Therefore robots that have missed a restart cannot bring back the older boot id.
/// Neighbours cannot change the state of this robot itself, or of robots that it receives directly.
///
/// In a team with keys the introduction of a robot contains its certificate. The signature of the
/// origin stays with each message from its sender to its reader. Each robot checks signature and
/// certificate before it uses, stores or forwards the message. Neighbours can therefore withhold
/// messages, but not change or invent them.
///
/// Memory is bounded for each origin and kind, and for all robots out of range together. When it is
/// full, new messages are refused and counted as given up. Deterministic; time comes in [s], with
/// any origin, and does not decrease. Not thread-safe.
class RelayStore {
 public:
  static constexpr std::size_t kMaxOrigins = 64;
  /// Storage for one origin [bytes]: an hour of bags at 4 Hz; thousands of closures; hundreds of
  /// keyframes.
  static constexpr std::size_t kMaxBagBytes = 8U << 20U;
  static constexpr std::size_t kMaxReliableBytes = 4U << 20U;
  static constexpr std::size_t kMaxReplyBytes = 8U << 20U;
  /// Storage for all robots out of range together, because a neighbour could invent any number of
  /// them.
  static constexpr std::size_t kMaxFarBytes = 128U << 20U;
  /// Storage for requests and replies to all addressees together.
  static constexpr std::size_t kMaxCarriedBytes = 4U << 20U;
  /// Bags or reliable messages of one origin in transit to one neighbour.
  static constexpr std::size_t kWindowBytes = 32U << 10U;
  /// Time for which a robot must have missed an origin before neighbours send it messages of that
  /// origin. At the start and after a short outage it soon receives them directly.
  static constexpr double kGrace_s = 5.0;
  /// Time after which messages that have not arrived are sent again, possibly by another robot.
  static constexpr double kPatience_s = 3.0;
  /// A message sent to a robot within this time before its link failed may not have arrived.
  static constexpr double kDoubt_s = 30.0;

  /// Without `keys` nothing is signed. With `keys`, messages of other robots are stored and
  /// forwarded with their signatures. Own messages, and messages that the store delivers, are
  /// passed without signatures.
  explicit RelayStore(TeamPeer self, std::optional<RelayKeys> keys = {})
      : self_(self), keys_(std::move(keys)) {}

  /// This robot receives `peer` directly from now on (connected), or no longer (lost).
  void connected(const RobotIdentity& peer);
  void lost(RobotId robot, double now_s);

  /// Stores a bag that its origin has sent directly. The bag may arrive before connected() is
  /// called for the origin.
  RelayArrival keep_bag(const RobotIdentity& origin, std::uint32_t number,
                        std::vector<std::uint8_t> content);
  /// Stores a keyframe that a known robot has sent directly as a reply.
  RelayArrival keep_reply(const TeamPeer& origin, std::uint32_t number,
                          std::vector<std::uint8_t> content);

  /// This robot has published a closure or an inlier set for `to`. If `to` is received directly,
  /// the message becomes a reliable message only if the link fails soon afterwards. If `to` is out
  /// of range, it becomes one at once; if `to` is unknown, the store decides at the first contact.
  /// A newer message of equal kind, `slot` and addressee replaces an older one. Only the
  /// incarnation of `to` receives it; with boot id 0, any incarnation.
  void wrote(RelayKind kind, const TeamPeer& to, std::uint64_t slot,
             std::vector<std::uint8_t> content, double now_s);
  /// Sends a request or a reply to a robot for which ways_to() reports a relay route.
  void call(RelayKind kind, RobotId to, std::uint32_t number, std::vector<std::uint8_t> content);

  /// Processes the summary in the status of a neighbour.
  void update(RobotId neighbour, const RelaySummary& summary, double now_s);
  /// Processes a message from a neighbour.
  RelayArrival receive(const RelayPacket& packet);
  /// Reason why the last message was kForged (a string literal).
  [[nodiscard]] const char* refusal() const { return refusal_; }

  [[nodiscard]] RelaySummary summary() const;
  [[nodiscard]] bool receives(RobotId robot) const { return neighbours_.contains(robot); }
  [[nodiscard]] std::optional<TeamPeer> origin(RobotId robot) const;
  [[nodiscard]] RelayWays ways_to(RobotId robot) const;
  /// Output since the last call.
  [[nodiscard]] RelayOutput take_output() { return std::exchange(output_, {}); }
  /// Number of messages refused because the storage was full.
  [[nodiscard]] std::uint64_t given_up() const { return given_up_; }

 private:
  // Messages of one kind and one origin by number, with the length of the first run without a gap.
  class Stream {
   public:
    [[nodiscard]] bool has(std::uint32_t number) const { return messages_.contains(number); }
    [[nodiscard]] std::uint32_t whole() const { return whole_; }
    [[nodiscard]] std::size_t bytes() const { return bytes_; }
    /// False if the stream would exceed `max_bytes`.
    [[nodiscard]] bool put(RelayMessage message, std::size_t max_bytes);
    /// Null if the message is missing.
    [[nodiscard]] const RelayMessage* find(std::uint32_t number) const;

   private:
    std::map<std::uint32_t, RelayMessage> messages_;
    std::uint32_t whole_ = 0;
    std::size_t bytes_ = 0;
  };
  // Proof that an origin belongs to the team; empty without keys.
  struct Membership {
    std::string credentials = {};
    std::optional<Certificate> certificate = {};
  };
  struct Origin {
    RobotIdentity identity;
    Membership membership = {};
    std::optional<RobotId> via = {};  // Neighbour that introduced the origin or sent its last bag.
    bool reachable = false;           // Reachability that was reported last.
    bool was_direct = false;
    Stream bags = {}, reliable = {}, replies = {};
  };
  struct Progress {
    std::uint32_t reported = 0;  // Number of messages that the neighbour reports.
    std::uint32_t sent = 0;
    double since_s = 0.0;  // Start of the time without progress.
  };
  struct Neighbour {
    std::set<RobotId> received = {};
    std::map<RobotId, RelayHeld> holds = {};
    std::map<std::pair<RobotId, bool>, Progress> progress = {};  // By origin; true for reliable
                                                                 // messages, false for bags.
    std::map<RobotId, double> misses_s = {};                     // By origin: start of the time
                                                                 // without contact.
    std::map<RobotId, double> introduced_s = {};
  };
  struct Recent {
    double sent_s = 0.0;
    std::uint64_t slot = 0;
    RelayMessage message;
  };

  /// Null if the limit of origins is reached.
  Origin* know(const RobotIdentity& identity);
  [[nodiscard]] Membership membership_of(const RobotIdentity& identity) const;
  void become(Origin& origin, const RobotIdentity& identity, Membership membership);
  [[nodiscard]] bool is_known(const TeamPeer& peer) const;
  [[nodiscard]] bool is_forged(const RelayMessage& message);
  void sign(RelayMessage& message) const;
  [[nodiscard]] std::size_t tail_bytes() const { return keys_ ? kEndorsementBytes : 0; }
  void deliver(const RelayMessagePtr& message);
  void hold_reply(RelayMessage message);
  RelayArrival introduce(RobotId from, const RelayMessage& message);
  RelayArrival meet(const RobotIdentity& identity, const std::string& credentials, RobotId from);
  RelayArrival keep(Stream Origin::*stream, std::size_t max_bytes, RelayMessage message);
  void settle_unmet(RobotId robot, bool direct);
  void add_reliable(std::uint64_t slot, RelayMessage message);
  void empty_reliable(std::uint32_t number);
  void drop_messages_to_former_incarnations(const TeamPeer& peer);
  void forward(RobotId to, double now_s);
  void forward(RobotId to, const Origin& origin, double now_s);
  void forward(RobotId to, const Origin& origin, bool reliable, std::uint32_t reported,
               double now_s);
  [[nodiscard]] bool has_room_for(const RelayMessage& message) const;
  [[nodiscard]] bool another_should(RobotId to, const RelayHeld& held) const;
  RelayArrival route(RelayMessage message, std::optional<RobotId> from);
  [[nodiscard]] bool answer(const RelayMessage& request);
  [[nodiscard]] std::optional<RobotId> next_hop(RobotId to, std::optional<RobotId> from) const;
  void renew_ways();
  void send(RobotId neighbour, RelayMessage message);

  TeamPeer self_;
  std::optional<RelayKeys> keys_;
  std::map<RobotId, Origin> origins_;
  std::map<RobotId, Neighbour> neighbours_;  // robots with a link to this one
  Stream own_reliable_;
  std::map<std::tuple<RelayKind, RobotId, std::uint64_t>, std::uint32_t> own_slots_;
  std::deque<Recent> recent_;  // Messages to robots received directly, oldest first.
  std::deque<Recent> unmet_;   // Messages to unknown robots, oldest first.
  // Messages kept for other robots, by addressee, then by kind, origin and number.
  std::map<RobotId, std::map<std::tuple<RelayKind, RobotId, std::uint32_t>, RelayMessage>> carried_;
  std::size_t carried_bytes_ = 0;
  RelayOutput output_;
  std::uint64_t given_up_ = 0;
  const char* refusal_ = nullptr;
};

}  // namespace km
