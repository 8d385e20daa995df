#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "runtime/overlay/known_robots.hpp"
#include "runtime/overlay/overlay_message.hpp"

namespace km {

/// Events and calls for robots that do not receive each other directly, now or ever. Every robot
///
/// - stores messages of each other robot (the origin): its bags of words, and its reliable
///   messages, which are closures and inlier sets for a robot out of its range;
/// - reports in its status how many messages of the other robots it holds (OverlayHeld). When a
///   neighbour reports less, it sends the missing messages in order, one window at a time, and
///   repeats them if they do not arrive. If several robots could send them, one that receives the
///   origin directly does;
/// - forwards calls along shortest paths. Without a route it replies to a request with its stored
///   copy of the keyframe. If it has no copy it keeps requests and replies until a route appears.
///
/// If all robots receive each other directly all the time, it sends nothing.
///
/// Memory is bounded for each origin and stream, and for all robots out of range together. When it
/// is full, the oldest messages of the same origin and stream are discarded, because they have most
/// likely arrived. A robot that has missed them gets the later messages. Deterministic; time comes
/// in [s], with any origin, and does not decrease. Not thread-safe.
class MessageStore {
 public:
  /// Storage for the newest messages of one origin [bytes]: an hour of bags at 4 Hz; thousands of
  /// closures; hundreds of keyframes.
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
  /// Time after which missing messages are skipped if later ones of their origin have arrived: the
  /// neighbours have discarded them.
  static constexpr double kGapPatience_s = 60.0;

  /// Both outlive this object; the packets to send are appended to `packets`.
  MessageStore(KnownRobots& robots, std::vector<OverlayPacket>& packets)
      : robots_(robots), packets_(packets) {}

  void connected(RobotId robot);
  void disconnected(RobotId robot, double now_s);
  /// An unknown robot has been introduced.
  void introduced(RobotId robot, double now_s) { introduced_s_[robot] = now_s; }
  /// Does the work that is due.
  void step(double now_s);
  /// The former process of a robot has ended. A resumed process sends all its closures again, so
  /// its stored reliable messages are discarded.
  void forget_process(RobotId robot) { held_[robot].reliable = {}; }
  /// Additionally, its other messages are void, and so are messages to its former incarnations.
  void forget_content(const TeamPeer& peer);
  void forget(RobotId robot) {
    held_.erase(robot);
    drop_carried(robot);
    introduced_s_.erase(robot);
  }

  // See Overlay.
  void write(OverlayStream stream, const TeamPeer& to, std::uint64_t slot,
             std::vector<std::uint8_t> content, double now_s);
  bool call(OverlayStream stream, RobotId to, std::uint32_t number,
            std::vector<std::uint8_t> content);

  /// Stores a bag of words or a reliable message of a known robot. `is_direct`: from its origin.
  OverlayArrival arrive(const OverlayMessage& message, bool is_direct);
  /// Stores a reply for other robots that request the keyframe.
  void hold_reply(OverlayMessage reply);
  /// Sends a call to its addressee, or stores it. `from`: the neighbour that has sent it.
  OverlayArrival route(OverlayMessage message, std::optional<RobotId> from);
  /// Sends the messages to addressees to which a route has appeared.
  void renew_routes();
  /// Sends the messages that a neighbour lacks.
  void forward(RobotId to, double now_s);

  [[nodiscard]] std::vector<OverlayHeld> holds() const;
  /// Number of messages refused, or discarded although they were not sent, because the storage was
  /// full.
  [[nodiscard]] std::uint64_t given_up() const { return given_up_; }
  /// Memory of all stored messages [bytes].
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // The newest messages of one stream and one origin, by number.
  class Numbered {
   public:
    // True if the message is stored, or may have been and was discarded.
    [[nodiscard]] bool has(std::uint32_t number) const {
      return number < first_ || messages_.contains(number);
    }
    // Least number of a message that has not been discarded.
    [[nodiscard]] std::uint32_t first() const { return first_; }
    // Number of messages up to the first gap, with the discarded ones.
    [[nodiscard]] std::uint32_t whole() const { return whole_; }
    [[nodiscard]] std::size_t bytes() const { return bytes_; }
    // Discards older messages if there are more than `max_bytes`. False if the message is too large
    // or older than these.
    [[nodiscard]] bool put(OverlayMessage message, std::size_t max_bytes);
    // Null if the message is missing.
    [[nodiscard]] const OverlayMessage* find(std::uint32_t number) const;
    // Extends whole() over a gap that has existed for kGapPatience_s.
    void skip_gap(double now_s);

   private:
    void extend_whole(std::uint32_t least);

    std::map<std::uint32_t, OverlayMessage> messages_;
    std::uint32_t first_ = 0;
    std::uint32_t whole_ = 0;
    std::size_t bytes_ = 0;
    std::optional<std::uint32_t> gap_;  // whole() at the present gap
    double gap_since_s_ = 0.0;
  };
  struct Held {
    Numbered bags = {}, reliable = {}, replies = {};
    [[nodiscard]] std::size_t bytes() const {
      return bags.bytes() + reliable.bytes() + replies.bytes();
    }
  };
  struct Progress {
    std::uint32_t reported = 0;  // Number of messages that the neighbour reports.
    std::uint32_t sent = 0;
    double since_s = 0.0;  // Start of the time without progress.
  };
  struct Receiver {
    std::map<std::pair<RobotId, bool>, Progress> progress = {};  // By origin; true for reliable
                                                                 // messages, false for bags.
    std::map<RobotId, double> misses_s = {};  // By origin: start of the time without contact.
  };
  struct Recent {
    double sent_s = 0.0;
    std::uint64_t slot = 0;
    OverlayMessage message;
  };

  struct Carried {
    std::uint64_t count = 0;  // ascends with each call that is kept
    OverlayMessage message;
  };

  [[nodiscard]] bool receives(RobotId robot) const { return robots_.receives(robot); }
  [[nodiscard]] bool is_met(RobotId robot, double now_s) const;
  [[nodiscard]] const Numbered& messages_of(RobotId robot, bool reliable) const;
  OverlayArrival carry(OverlayMessage message);
  void drop_carried(RobotId to);
  void settle_unmet(RobotId robot, bool direct);
  void add_reliable(std::uint64_t slot, OverlayMessage message);
  void empty_reliable(std::uint32_t number);
  void drop_messages_to_former_incarnations(const TeamPeer& peer);
  void forward(RobotId to, const TeamPeer& origin, double now_s);
  void forward(RobotId to, const TeamPeer& origin, bool reliable, std::uint32_t reported,
               double now_s);
  [[nodiscard]] std::size_t room_for(RobotId origin) const;
  [[nodiscard]] bool another_should(RobotId to, const OverlayHeld& held) const;
  [[nodiscard]] bool answer(const OverlayMessage& request);
  void send(RobotId neighbour, OverlayMessage message);

  KnownRobots& robots_;
  std::vector<OverlayPacket>& packets_;
  std::map<RobotId, Held> held_;
  std::map<RobotId, Receiver> receivers_;
  Numbered own_reliable_;
  std::map<std::tuple<OverlayStream, RobotId, std::uint64_t>, std::uint32_t> own_slots_;
  std::deque<Recent> recent_;  // Messages to robots received directly, oldest first.
  // Messages to robots that are unknown or were introduced less than kGrace_s ago, oldest first.
  std::deque<Recent> unmet_;
  std::map<RobotId, double> introduced_s_;  // Robots that were never received directly.
  // Calls kept for other robots, by addressee, stream, origin and number.
  std::map<std::tuple<RobotId, OverlayStream, RobotId, std::uint32_t>, Carried> carried_;
  std::size_t carried_bytes_ = 0;
  std::uint64_t carried_count_ = 0;
  std::uint64_t given_up_ = 0;
};

}  // namespace km
