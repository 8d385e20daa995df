#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "modules/core/team_links.hpp"
#include "modules/pose_graph/team_messages.hpp"

namespace km {

using TeamMessagePtr = std::shared_ptr<const TeamMessage>;

/// Result of the arrival of a message.
enum class [[nodiscard]] Arrival{
    kNew,       ///< New message for this robot.
    kRepeated,  ///< Not newer than the known message of its origin.
    kPassedOn,  ///< Reliable message to another robot, forwarded.
    kLost,      ///< Reliable message to an unreachable robot, or one that has passed here before.
    kRefused,   ///< Wrong boot id of the origin, or too many robots.
    kNoRoom,    ///< Too many bytes are held from the robot that forwarded it.
};

/// The part of one robot in forwarding the messages of the team over any links.
///
/// Statuses, sessions and poses go to all robots of the team; the newest message of each origin and
/// kind counts. A robot that receives a newer one forwards it to the robots that it receives
/// directly. It omits robots to which the origin or the previous robot has already sent it,
/// according to the reported links: if all robots receive each other, nothing is sent twice. A
/// robot that is received again gets all messages whose origins it does not receive directly.
///
/// Lost messages show in the hash of all messages that a robot holds, which its status contains.
/// Robots that receive each other compare these hashes, as in epidemic routing by summary vectors
/// (Vahdat and Becker, "Epidemic Routing for Partially-Connected Ad Hoc Networks", 2000), here with
/// eight bytes instead of a vector. If they differ, a robot forwards the messages that are older
/// than `period_s`, and repeats this ever more rarely while the hashes still differ.
///
/// Reliable messages go hop by hop along shortest paths; each copy passes each robot once.
/// Deterministic; not thread-safe.
class Relay {
 public:
  Relay(TeamPeer self, double period_s) : self_(self), period_s_(period_s) {}

  /// Time for which a lost link is still reported [s]: many links return at once, and no other
  /// robot needs to know.
  static constexpr double kPatience_s = 3.0;

  /// Limit of the messages held from one robot [bytes in memory]; messages beyond it are refused.
  /// Statuses, sessions and public poses of a thousand keyframes of a hundred robots fit.
  static constexpr std::size_t kMaxHeldFromOne = 4U << 20U;

  /// This robot begins or ceases to receive `peer` directly.
  void link_up(TeamPeer peer, double now_s);
  void link_down(RobotId robot, double now_s);
  /// Does the work that is due at `now_s`.
  void step(double now_s);

  /// Sends a message of this robot, with the next number of its kind (reliable messages: copy), to
  /// all its receivers. Fills in `receives` and `holds` of a status. Returns the number of
  /// transmissions.
  std::size_t publish(TeamMessage message, double now_s);
  /// Sends the last status again to the robots that receive this one, with the present hash.
  void repeat_status(double now_s);

  /// Processes a message that `from` has forwarded.
  Arrival receive(RobotId from, const TeamMessagePtr& message, double now_s);

  /// The messages to send, in order; empty thereafter.
  [[nodiscard]] std::vector<LinkPacket> take_packets() { return std::exchange(packets_, {}); }

  /// Robots that were received directly within the last kPatience_s; ascending.
  [[nodiscard]] std::vector<TeamPeer> receives() const;
  [[nodiscard]] const TeamLinks& links() const { return links_; }
  /// Grows when links() changes.
  [[nodiscard]] std::uint64_t links_version() const { return links_version_; }
  /// The next robot on the way to `to`: `to` itself if it is received directly. Otherwise the
  /// directly received robot with the shortest path, except for `from`; the lowest id decides a
  /// tie. nullopt if there is none.
  [[nodiscard]] std::optional<RobotId> next_hop(RobotId to, std::optional<RobotId> from = {}) const;
  /// Hash of all messages held.
  [[nodiscard]] std::uint64_t holds() const;

 private:
  static constexpr std::size_t kFlooded = 3;  // kinds: TeamStatus, Session, MemberPoses
  struct Held {
    TeamMessagePtr message;
    std::uint32_t number = 0;
    double learned_s = 0.0;
    RobotId from = 0;       // robot that has forwarded it
    std::size_t bytes = 0;  // 0 for messages of this robot
  };
  struct Origin {
    std::uint64_t boot = 0;
    std::array<std::optional<Held>, kFlooded> newest = {};
  };
  struct Served {
    std::uint32_t number = 0;
    double sent_s = 0.0;
    bool confirmed = false;  // the neighbour has shown that it has it
  };
  struct Neighbour {
    std::uint64_t boot = 0;
    std::map<std::pair<RobotId, std::size_t>, Served> served = {};  // by origin and kind
    double repair_s = 0.0;  // earliest time of the next repair
    double patience_s = 0.0;
  };
  // Copies of reliable messages of one robot to another that have passed here.
  struct Passed {
    std::uint64_t boot = 0;
    std::set<std::uint32_t> copies = {};
  };

  [[nodiscard]] bool accepts(const TeamPeer& origin);
  [[nodiscard]] bool hold(std::optional<Held>& held, Held newer);
  [[nodiscard]] bool received_by_any(const TeamPeer& peer) const;
  void meet(const TeamPeer& peer);
  void report_links(const TeamStatus& status);
  void renew_links();
  void renew_own_links();
  void pass_on(RobotId from, RobotId origin, std::size_t kind, double now_s);
  void compare(const TeamStatus& status, double now_s);
  void send(RobotId next, RobotId origin, std::size_t kind, double now_s);
  Arrival route(RobotId from, const TeamMessagePtr& message);

  TeamPeer self_;
  double period_s_;
  TeamLinks links_;
  std::uint64_t links_version_ = 0;
  std::map<RobotId, Origin> origins_;  // this robot included
  struct Gone {
    std::uint64_t boot = 0;
    double since_s = 0.0;
  };
  std::map<RobotId, std::size_t> held_from_;  // bytes, by the robot that has forwarded them
  std::map<RobotId, Neighbour> direct_;
  std::map<RobotId, Gone> gone_;                          // lost links, for at most kPatience_s
  std::map<std::pair<RobotId, RobotId>, Passed> passed_;  // by sender and receiver
  std::map<RobotId, std::uint32_t> copies_;               // number of the next copy, by receiver
  std::array<std::uint32_t, kFlooded> numbers_ = {};      // last numbers of this robot, by kind
  std::vector<LinkPacket> packets_;
};

}  // namespace km
