#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "modules/core/data/team_solution.hpp"
#include "modules/session/agent_state.hpp"

namespace km {

/// The part of one robot in the pose graph optimisation of the team, as a state machine without
/// threads and clocks. README.md states the protocol.
///
/// The team of a robot is all robots that links connect to it, directly or through other robots.
/// Messages may arrive over any of them (see Overlay in runtime/overlay). The keyframes after a
/// step of unknown length (another run of the robot) are located once kept closures at two places
/// tie them to the runs before. Until then, no trajectory is published. If all members have
/// verticals, these are part of the cost, and `world` has z up. Deterministic: equal inputs in
/// equal order give equal outputs. Not thread-safe.
class TeamAgent {
 public:
  /// `dimension` 2: poses and measurements are planar, as in TreeNewtonOptions. Throws ConfigError
  /// if `config` is out of bounds.
  TeamAgent(const PoseGraphConfig& config, TeamPeer self, MemberSolverFactory factory,
            int dimension = 3);

  /// Adds own measurements and decisions on them; see OwnGraph for the ignored ones. False if
  /// nothing has changed. refused() counts invalid inputs.
  bool add(const KeyframeOdometry& keyframe);
  bool add(const Closure& closure);
  bool add(const InlierSet& set);
  bool add(const PositionFix& fix);

  /// Continues from the solution of a former process, once as many keyframes are added as it has
  /// poses. Until the other robots return, their poses are held.
  /// Call before all other inputs.
  void restore(const TeamSolution& solution);

  /// Keyframe 0 is the first keyframe of the finished map with this identity; 0: there is no such
  /// map. Call before all other inputs.
  void begin_in_map(std::uint64_t map_id) { state_.map_id = map_id; }

  /// This robot begins or ceases to receive another robot directly.
  void peer_alive(TeamPeer peer);
  void peer_lost(RobotId robot) { state_.direct.erase(robot); }
  /// The links of the team have changed. An older report than the last one is ignored.
  void update_links(const LinksReport& links);

  /// The keyframe indices of `peer` have a new meaning from now on: earlier measurements of it are
  /// discarded.
  void peer_restarted(const TeamPeer& peer);

  /// Processes a message of another robot. Reliable messages may be reordered, repeated or lost.
  /// Other messages are newer than all before of their origin and kind. False if the message is
  /// refused.
  bool receive(const TeamMessage& message);

  /// Does the work that is due, at most one piece of work of a solver. Call it after every input
  /// and, for repetitions, several times per second; `now_s` [s] must not decrease. `sent_bytes`:
  /// bytes that this robot has sent for sessions so far, per receiver, and with forwarded messages.
  TeamOutput step(double now_s, std::uint64_t sent_bytes);

  /// Own poses in frame(): the last result, and odometry since.
  [[nodiscard]] const std::vector<SE3>& poses() const { return state_.poses.T_frame_kf(); }
  [[nodiscard]] const TeamFrame& frame() const { return state_.frame; }
  /// The present or last session of this robot.
  [[nodiscard]] const SessionPart* part() const { return state_.part ? &*state_.part : nullptr; }
  /// False if the session of part() has ended.
  [[nodiscard]] bool in_session() const { return state_.in_session(); }
  [[nodiscard]] const std::map<ClosureId, bool>& decided() const {
    return state_.decisions.decided();
  }
  /// Number of refusals by reason.
  [[nodiscard]] const std::map<std::string, std::size_t>& refused() const {
    return state_.notices.refused();
  }

 private:
  AgentState state_;
};

}  // namespace km
