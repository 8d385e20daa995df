#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>

#include "modules/core/data/team_links.hpp"
#include "modules/session/pgo_method.hpp"
#include "modules/session/team_messages.hpp"

namespace km {

/// The other robots of a team as one robot knows them: their newest messages, and which of them
/// links connect to it. Not thread-safe.
class TeamRoster {
 public:
  struct Peer {
    std::uint64_t boot = 0;
    std::optional<TeamStatus> status = {};
    std::optional<Session> session = {};  ///< The newest session that it coordinates.
    std::uint32_t joined = 0;             ///< Number of its last session that this robot joined.
    std::uint32_t missed = 0;             ///< Number of its last session that it could not join.
    bool other_method = false;            ///< It uses another solver: its edges are not optimised.
  };
  /// How a robot has been met.
  enum class Meeting {
    kKnown,
    kNew,
    kOtherProcess,      ///< Its former process has ended; its keyframes keep their meaning.
    kOtherIncarnation,  ///< Its keyframe indices have a new meaning.
  };

  TeamRoster(TeamPeer self, PgoMethod method) : self_(self), method_(method) {}

  /// Registers a robot. The messages of its former process are discarded.
  Meeting meet(const TeamPeer& peer);
  /// Precondition of the following: the sender was met.
  void take(const TeamStatus& status);
  void take(const Session& session);
  void take(const MemberPoses& poses) { public_poses_[poses.sender.robot] = poses; }
  /// The newest public poses of a robot are the result of a session.
  void keep_result(RobotId robot) { results_[robot] = public_poses_.at(robot); }

  /// Adopts the robots that `links` connect to this one.
  void connect(const TeamLinks& links) { component_ = links.component(self_.robot); }
  /// True for this robot, and for a known process that links connect to it.
  [[nodiscard]] bool in_reach(const TeamPeer& peer) const;

  /// By robot, without this one.
  [[nodiscard]] const std::map<RobotId, Peer>& peers() const { return peers_; }
  [[nodiscard]] const Peer* find(RobotId robot) const;
  /// Precondition: the robot was met.
  [[nodiscard]] Peer& at(RobotId robot) { return peers_.at(robot); }
  /// The newest public poses of each robot, those of this robot included.
  [[nodiscard]] const PublicPoses& public_poses() const { return public_poses_; }
  /// The poses of each robot by the last session that it has completed, as far as they are known.
  [[nodiscard]] const PublicPoses& results() const { return results_; }

  /// The statuses from which sessions are planned: `own`, and those of robots in reach with the
  /// same method.
  [[nodiscard]] std::map<RobotId, TeamStatus> statuses(TeamStatus own) const;

 private:
  TeamPeer self_;
  PgoMethod method_;
  std::map<RobotId, Peer> peers_;
  PublicPoses public_poses_;
  PublicPoses results_;
  std::set<RobotId> component_;
};

}  // namespace km
