#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "modules/core/team_solution.hpp"
#include "modules/session/agent_state.hpp"

namespace km {

/// The part of one robot in the pose graph optimisation of the team, as a state machine without
/// threads and clocks.
///
/// The team of a robot is all robots that links connect to it, directly or through other robots.
/// Messages may arrive over any of them (see Overlay in runtime/overlay). Robots of a team that
/// share inlier closures, directly or through other robots, optimise together in sessions. A
/// session freezes the graph: its members, and for every pair of members the edge set that both
/// hold. The member with the lowest id coordinates the session: it opens the session when the graph
/// has changed, and ends it. A robot without partners coordinates its own sessions. SessionPart
/// implements a session of one member; a factory supplies the solver of its graph.
///
/// New measurements do not interrupt a session; see SessionSchedule for the time of the next one.
/// Until then each robot refines its poses alone: without a message, it solves its own graph with
/// its new closures and the poses that the other robots have last sent. A
/// session ends early when links to a member no longer exist. Links that return at once do no
/// harm, because messages are repeated and find other ways. The members of the interrupted session
/// keep the result of the last one.
///
/// A session decides from the measurements of its members alone: no pose, verdict or estimate of an
/// earlier session is an input. The result therefore does not depend on the order in which robots
/// have met. Exceptions are the poses of robots out of reach, and the verdicts on closures to them.
///
/// The other robots hold the last public poses of a robot that is out of reach, so that they keep
/// their frame and its measurements. When this robot returns, it catches up. If it returns as
/// another process, its poses are discarded; if it returns with another incarnation, closures to it
/// are discarded, too.
///
/// A robot that closures at a single place tie to the others is joined tentatively; see FrameTies.
/// If the team rejects all closures that tie some members, the robots on each side publish their
/// poses in the frame of their lowest robot. Later closures join them again.
///
/// The keyframes after a step of unknown length (another run of the robot) are located once kept
/// closures at two places tie them to the runs before. Until then, no trajectory is published,
/// because the poses of these keyframes are unknown.
///
/// A datum is a frame outside the run: that of fixes or of a finished map. Keyframe 0 is its
/// origin. Fixes (see place_fixes()) or closures with the map locate a robot in its datum. The
/// robot and all members that closures tie to it then publish in the datum. Keyframes 0 of members
/// in one datum are one pose, see datum_ties(). Robots in one datum share its frame also without
/// closures.
///
/// If all members have verticals, these are part of the cost, and `world` has z up. Deterministic:
/// equal inputs in equal order give equal outputs. Not thread-safe.
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
  [[nodiscard]] const TeamFrame& frame() const { return state_.frame.frame(); }
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
