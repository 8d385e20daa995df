#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/data/team_links.hpp"
#include "modules/core/robot_identity.hpp"
#include "runtime/overlay/endorsement.hpp"
#include "runtime/overlay/overlay_message.hpp"

namespace km {

/// Result for a message that a neighbour has sent.
enum class [[nodiscard]] OverlayArrival{
    kNew,       ///< Message to deliver, to forward or to store.
    kRepeated,  ///< The message is already known, or its origin is received directly.
    kRefused,   ///< The boot id of its origin is unknown, the origin is this robot, or the message
                ///< has passed too many robots.
    kForged,    ///< Its origin has not signed it or is not a member; see Overlay::refusal().
    kNoRoom,    ///< Dropped because the storage is full.
};

/// Meaning of the identity of a robot for the messages that are held of it.
enum class Meeting {
  kNoRoom,        ///< kMaxTeam other robots are known.
  kKnown,         ///< The same process as before.
  kNew,           ///< An unknown robot.
  kOtherProcess,  ///< Its former process has ended; its keyframes keep their meaning.
  kOtherContent,  ///< Another incarnation, or another key: messages of before are void.
};

/// Validity of a message in a team with keys.
enum class Proof {
  kValid,
  kForged,  ///< Not signed by the known process that is stated as its origin.
  kLapsed,  ///< The certificate of its origin is revoked, or not valid now.
};

/// Robots of the team as one robot knows them, and the links between them.
///
/// A robot becomes known when it is received directly or when a neighbour introduces it. A new boot
/// id of a known robot is accepted only if some robot receives this process directly. That is this
/// robot, or one that links connect to it and that reports so. Therefore robots that have missed a
/// restart cannot bring back the older boot id. Not thread-safe.
class KnownRobots {
 public:
  /// Time for which a lost link is still reported: many links return at once, and no other robot
  /// needs to know.
  static constexpr double kLinkPatience_s = 3.0;
  /// Time after which a robot is introduced again to a neighbour that does not report it.
  static constexpr double kIntroduceAgain_s = 3.0;

  struct Robot {
    RobotIdentity identity;
    std::string credentials = {};                 ///< Empty without keys.
    std::optional<Certificate> certificate = {};  ///< Proof of its membership.
    bool was_direct = false;                      ///< It has been received directly.
    double lost_s = -1e9;                         ///< Last time when it was lost.
  };
  /// A robot that this robot receives directly.
  struct Neighbour {
    std::map<RobotId, OverlayHeld> holds = {};  ///< As reported last, by origin.
    std::map<RobotId, double> introduced_s = {};
    double complete_s = 0.0;  ///< Last time when a packet of it arrived, or when none was missing.
    bool is_missed = false;   ///< Its statuses arrive, but not its packets.
    double renewed_s = -1e9;  ///< Last time when it missed packets of this robot.
  };

  KnownRobots(TeamPeer self, std::optional<OverlayKeys> keys)
      : self_(self), keys_(std::move(keys)) {}

  [[nodiscard]] const TeamPeer& self() const { return self_; }
  [[nodiscard]] bool has_keys() const { return keys_.has_value(); }

  // Identities.

  /// Registers a process that is received directly.
  Meeting meet(const RobotIdentity& identity);
  struct Introduced {
    OverlayArrival arrival = OverlayArrival::kRefused;
    Meeting meeting = Meeting::kKnown;  ///< Set if the introduction is new.
    RobotIdentity identity = {};
  };
  /// Processes an introduction by a neighbour.
  Introduced introduce(const OverlayMessage& message);
  /// Introduction of a robot for a neighbour; nullopt if the neighbour knows the robot, or if the
  /// robot cannot be introduced or was introduced a moment ago.
  [[nodiscard]] std::optional<OverlayMessage> introduction(RobotId neighbour, RobotId robot,
                                                           double now_s);
  void forget(RobotId robot);
  /// The robot whose place another one may take: one that has never been received directly, or the
  /// one that has been lost for longest. nullopt if all are received directly.
  [[nodiscard]] std::optional<RobotId> replaceable() const;

  [[nodiscard]] const std::map<RobotId, Robot>& all() const { return robots_; }
  /// Present process of a known robot.
  [[nodiscard]] std::optional<TeamPeer> process(RobotId robot) const;
  /// True if messages can be attributed to this process. False after its keys have been removed,
  /// even if it is received directly.
  [[nodiscard]] bool is_known(const TeamPeer& peer) const;
  /// True if the neighbour reports this process.
  [[nodiscard]] bool knows(RobotId neighbour, const TeamPeer& peer) const;

  /// Signs a message of this robot in a team with keys.
  void sign(OverlayMessage& message) const;
  /// Precondition: is_known(message.origin). Valid without keys.
  Proof check(const OverlayMessage& message);
  /// Reason of the last forgery (a string literal).
  [[nodiscard]] const char* refusal() const { return refusal_; }

  // Links.

  void connect(RobotId robot);
  /// True if the certificate of a known robot is not valid any more.
  [[nodiscard]] bool has_lapsed(RobotId robot) const;
  /// False if it was not received.
  bool disconnect(RobotId robot, double now_s);
  /// Removes lost links from the report of this robot when their time is over.
  void expire(double now_s);
  /// Processes the report of a known robot.
  void report(RobotId robot, std::vector<TeamPeer> received);
  void forget_report(RobotId robot);

  [[nodiscard]] bool receives(RobotId robot) const { return neighbours_.contains(robot); }
  [[nodiscard]] std::map<RobotId, Neighbour>& neighbours() { return neighbours_; }
  [[nodiscard]] const std::map<RobotId, Neighbour>& neighbours() const { return neighbours_; }
  /// Processes that this robot reports as received directly, ascending.
  [[nodiscard]] std::vector<TeamPeer> own_links() const;
  [[nodiscard]] const TeamLinks& links() const { return links_; }
  /// Grows when links() changes.
  [[nodiscard]] std::uint64_t links_version() const { return links_version_; }
  /// True if any robot reports that it receives a robot which this robot does not receive.
  [[nodiscard]] bool has_far() const;
  /// The next robot on the way to `to`: `to` itself if it is received directly. Otherwise the
  /// neighbour with the shortest path, except for `from`; the lowest id decides a tie. nullopt if
  /// there is none.
  [[nodiscard]] std::optional<RobotId> next_hop(RobotId to, std::optional<RobotId> from = {}) const;

 private:
  struct Gone {
    std::uint64_t boot = 0;
    double since_s = 0.0;
  };

  [[nodiscard]] Meeting become(Robot robot);
  [[nodiscard]] Robot certified(const RobotIdentity& identity) const;
  [[nodiscard]] bool is_reported(const TeamPeer& peer) const;
  void renew_report(RobotId robot);
  void renew_own_links();
  void count_change(bool changed) { links_version_ += changed ? 1 : 0; }

  TeamPeer self_;
  std::optional<OverlayKeys> keys_;
  std::map<RobotId, Robot> robots_;
  std::map<RobotId, std::vector<TeamPeer>> reports_;
  std::map<RobotId, Neighbour> neighbours_;
  std::map<RobotId, Gone> gone_;  // lost links, for at most kLinkPatience_s
  TeamLinks links_;
  std::uint64_t links_version_ = 0;
  const char* refusal_ = nullptr;
};

}  // namespace km
