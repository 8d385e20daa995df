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

/// What became of a message that another robot handed over.
enum class [[nodiscard]] RelayArrival{
    kNew,       ///< To be delivered, or passed on, or kept for others.
    kRepeated,  ///< Known already, or its origin is heard directly.
    kRefused,   ///< Its origin is not known in this life, or is this robot, or who hands it over is
                ///< no neighbour.
    kForged,    ///< Its origin has not signed it, or is no member, see RelayStore::refusal().
    kNoRoom,    ///< Given up: its origin, or what is carried, has no room left.
};

/// How a message for one robot gets there.
struct RelayWays {
  bool direct = true;  ///< DDS carries it, or keeps it for a robot that was heard.
  bool relay = false;

  bool operator==(const RelayWays&) const = default;
};

/// What a RelayStore wants done.
struct RelayOutput {
  std::vector<RelayParcel> parcels;        ///< To be sent.
  std::vector<RelayMessagePtr> delivered;  ///< For this robot to read, in order.
  std::vector<RobotIdentity> met;          ///< Told of by others: new, or another process.
  std::vector<RobotId> reachable;          ///< Not heard, but from now on ways lead there.
};

/// One robot's part in carrying what robots tell each other outside the pose graph to those that do
/// not hear each other, at the same time or ever. Every robot
///
/// - keeps what it hears or is handed of each other robot (the origin): its bags of words, and its
///   letters, which are closures and inlier sets to a robot that it does not hear;
/// - tells whom it hears, and how much it holds of those that it does not (RelaySummary). On
///   hearing that of a neighbour it hands over what that lacks, in order, a window at a time, and
///   again if that does not arrive. Of several that could, the first that hears the origin does;
/// - passes requests for keyframes and their answers on, to the addressee or to a neighbour that
///   hears it, else back the way on which its bags came. Where no way leads it answers with what it
///   has had of that keyframe before; without that it carries the message until there is one.
///
/// Where all robots hear each other nothing is sent. A robot is known once it is heard or a
/// neighbour introduces it. Another life of it is believed of whom it was known by before and of
/// those that hear it: so of two lives the older cannot come back from robots that have missed the
/// change. Nothing is believed about this robot itself, nor about those that it hears.
///
/// With the keys of a team a robot is introduced with its certificate, and what each origin says
/// carries its signature from where it is said to where it is read. All of it is checked before it
/// is believed, kept or handed on: neighbours can hold things back, not change or invent them.
///
/// Memory is bounded for each origin and kind, and for all that are not heard together; full, what
/// is newest is not taken and counts as given up. Deterministic; time comes in [s], any origin, not
/// decreasing. Not thread-safe.
class RelayStore {
 public:
  static constexpr std::size_t kMaxOrigins = 64;
  /// Held of one origin [octets]: an hour of bags at 4 Hz; thousands of closures; and hundreds of
  /// keyframes.
  static constexpr std::size_t kMaxBagBytes = 8U << 20U;
  static constexpr std::size_t kMaxLetterBytes = 4U << 20U;
  static constexpr std::size_t kMaxReplyBytes = 8U << 20U;
  /// Held of all robots together that are not heard: whoever is heard can invent such.
  static constexpr std::size_t kMaxFarBytes = 128U << 20U;
  /// Requests and answers carried for all addressees together.
  static constexpr std::size_t kMaxCarriedBytes = 4U << 20U;
  /// Under way to one neighbour of one origin's bags or letters.
  static constexpr std::size_t kWindowBytes = 32U << 10U;
  /// So long a robot must have missed another one before it is handed anything of that: at the
  /// start, and after a short outage, it hears it itself soon.
  static constexpr double kGrace_s = 5.0;
  /// After which what has not arrived is handed over again, or by the next robot that could.
  static constexpr double kPatience_s = 3.0;
  /// What was sent to a robot so shortly before it fell silent may not have arrived.
  static constexpr double kDoubt_s = 30.0;

  /// Without `keys` nothing is signed. With them what is kept of other robots comes signed and is
  /// passed on so; what this robot says, and what it is given to read, is without signatures.
  explicit RelayStore(TeamPeer self, std::optional<RelayKeys> keys = {})
      : self_(self), keys_(std::move(keys)) {}

  /// A robot is heard directly from now on, or no more.
  void heard(const RobotIdentity& peer);
  void lost(RobotId robot, double now_s);

  /// A bag that its origin told directly; it may come before heard().
  RelayArrival keep_bag(const RobotIdentity& origin, std::uint32_t number,
                        std::vector<std::uint8_t> content);
  /// Likewise a keyframe asked for, of a robot that is known.
  RelayArrival keep_reply(const TeamPeer& origin, std::uint32_t number,
                          std::vector<std::uint8_t> content);

  /// This robot has told `to` a closure or inlier set, directly if that is heard: a letter if not,
  /// or if it falls silent soon; of a robot that has not been met yet that is seen then. Of one
  /// kind and `slot` to one robot the last counts. It is for the life of the process `to` alone,
  /// of boot 0 for any.
  void wrote(RelayKind kind, const TeamPeer& to, std::uint64_t slot,
             std::vector<std::uint8_t> content, double now_s);
  /// Sends a request or an answer to a robot that ways_to() says to be reached so.
  void call(RelayKind kind, RobotId to, std::uint32_t number, std::vector<std::uint8_t> content);

  /// What a neighbour tells of itself.
  void told(RobotId neighbour, const RelaySummary& summary, double now_s);
  /// A message that it has handed over.
  RelayArrival receive(const RelayParcel& parcel);
  /// Why the last message was kForged (a string literal).
  [[nodiscard]] const char* refusal() const { return refusal_; }

  [[nodiscard]] RelaySummary summary() const;
  [[nodiscard]] bool hears(RobotId robot) const { return neighbours_.contains(robot); }
  [[nodiscard]] std::optional<TeamPeer> origin(RobotId robot) const;
  [[nodiscard]] RelayWays ways_to(RobotId robot) const;
  /// Since the last call.
  [[nodiscard]] RelayOutput take_output() { return std::exchange(output_, {}); }
  /// Messages that were not taken for want of room.
  [[nodiscard]] std::uint64_t given_up() const { return given_up_; }

 private:
  // Messages of one kind of one origin by number, and how many there are without a gap.
  class Stream {
   public:
    [[nodiscard]] bool has(std::uint32_t number) const { return messages_.contains(number); }
    [[nodiscard]] std::uint32_t whole() const { return whole_; }
    [[nodiscard]] std::size_t bytes() const { return bytes_; }
    /// False if that would be more than `max_bytes`.
    [[nodiscard]] bool put(RelayMessage message, std::size_t max_bytes);
    /// Null unless it is there.
    [[nodiscard]] const RelayMessage* find(std::uint32_t number) const;

   private:
    std::map<std::uint32_t, RelayMessage> messages_;
    std::uint32_t whole_ = 0;
    std::size_t bytes_ = 0;
  };
  // What shows that an origin is one of the team: nothing without keys.
  struct Membership {
    std::string credentials = {};
    std::optional<Certificate> certificate = {};
  };
  struct Origin {
    RobotIdentity identity;
    Membership membership = {};
    std::optional<RobotId> via = {};  // who has introduced it, or handed over its last bag
    bool reachable = false;           // as last told
    bool was_heard = false;
    Stream bags = {}, letters = {}, replies = {};
  };
  struct Progress {
    std::uint32_t told = 0;  // by the neighbour
    std::uint32_t sent = 0;
    double since_s = 0.0;  // without progress
  };
  struct Neighbour {
    std::set<RobotId> hears = {};
    std::map<RobotId, RelayHeld> holds = {};
    std::map<std::pair<RobotId, bool>, Progress> progress = {};  // by origin; of letters, or bags
    std::map<RobotId, double> misses_s = {};                     // others, since when
    std::map<RobotId, double> introduced_s = {};
  };
  struct Recent {
    double sent_s = 0.0;
    std::uint64_t slot = 0;
    RelayMessage message;
  };

  /// Null if there is one too many.
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
  void settle_unmet(RobotId robot, bool heard);
  void write_letter(std::uint64_t slot, RelayMessage message);
  void empty_letter(std::uint32_t number);
  void end_letters_to_former_lives(const TeamPeer& peer);
  void hand_on(RobotId to, double now_s);
  void hand_on(RobotId to, const Origin& origin, double now_s);
  void hand_on(RobotId to, const Origin& origin, bool letters, std::uint32_t told, double now_s);
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
  std::map<RobotId, Neighbour> neighbours_;  // those heard
  Stream own_letters_;
  std::map<std::tuple<RelayKind, RobotId, std::uint64_t>, std::uint32_t> own_slots_;
  std::deque<Recent> recent_;  // oldest first
  std::deque<Recent> unmet_;   // to robots that are not known; oldest first
  // By addressee, then kind, origin and number.
  std::map<RobotId, std::map<std::tuple<RelayKind, RobotId, std::uint32_t>, RelayMessage>> carried_;
  std::size_t carried_bytes_ = 0;
  RelayOutput output_;
  std::uint64_t given_up_ = 0;
  const char* refusal_ = nullptr;
};

}  // namespace km
