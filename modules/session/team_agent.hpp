#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "modules/core/closure_verdicts.hpp"
#include "modules/core/team_links.hpp"
#include "modules/core/team_solution.hpp"
#include "modules/robust/fix_placement.hpp"
#include "modules/robust/lone_solution.hpp"
#include "modules/session/closure_decisions.hpp"
#include "modules/session/frame_ties.hpp"
#include "modules/session/own_graph.hpp"
#include "modules/session/own_poses.hpp"
#include "modules/session/pose_graph_config.hpp"
#include "modules/session/refinement_schedule.hpp"
#include "modules/session/session_part.hpp"
#include "modules/session/session_schedule.hpp"
#include "modules/session/team_messages.hpp"
#include "modules/session/team_notices.hpp"
#include "modules/session/team_roster.hpp"

namespace km {

/// Outputs of a step of the agent, to other robots and to its own robot.
struct [[nodiscard]] TeamOutput {
  std::vector<TeamMessage> messages = {};
  std::optional<Trajectory> trajectory = {};
  std::optional<OptimizerProgress> progress = {};
  std::optional<ClosureVerdicts> verdicts = {};  ///< After a session.
  std::vector<std::string> notices = {};         ///< Messages for a person.
  bool more = false;  ///< The next step has work even without further input.
};

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
  void begin_in_map(std::uint64_t map_id) { map_id_ = map_id; }

  /// This robot begins or ceases to receive another robot directly.
  void peer_alive(TeamPeer peer);
  void peer_lost(RobotId robot) { direct_.erase(robot); }
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
  [[nodiscard]] const std::vector<SE3>& poses() const { return poses_.T_frame_kf(); }
  [[nodiscard]] const TeamFrame& frame() const { return frame_.frame(); }
  /// The present or last session of this robot.
  [[nodiscard]] const SessionPart* part() const { return part_ ? &*part_ : nullptr; }
  /// False if the session of part() has ended.
  [[nodiscard]] bool in_session() const {
    return state_ == SessionState::kRunning || state_ == SessionState::kDeserted;
  }
  [[nodiscard]] const std::map<ClosureId, bool>& decided() const { return decisions_.decided(); }
  /// Number of refusals by reason.
  [[nodiscard]] const std::map<std::string, std::size_t>& refused() const {
    return notices_.refused();
  }

 private:
  struct Objective {
    double cost = 0.0;
    double gradient = 0.0;
  };

  enum class SessionState {
    kNone,  // there has been no session
    kRunning,
    kDeserted,   // it runs, and a member has joined another session
    kAbandoned,  // it ended without a solution of all members
    kSolved,     // it ended, and all members have its solution
  };

  // Other robots and their messages.
  void meet(const TeamPeer& peer);
  void forget_measured(RobotId robot);
  bool take(const TeamPeer& sender, const TeamStatus& status);
  bool take(const TeamPeer& sender, const Session& session);
  bool take(const TeamPeer& sender, const MemberPoses& poses);
  bool take(const TeamPeer& sender, const ReliableMessage& message);
  bool refuse(const std::string& what) { return notices_.refuse(what); }
  [[nodiscard]] TeamStatus make_status();
  void send_status(TeamOutput& output);

  // Plans and sessions that this robot coordinates.
  void make_plan();
  void coordinate(TeamOutput& output);
  [[nodiscard]] bool all_upright(const SessionPlan& plan) const;
  [[nodiscard]] bool has_moved_on() const;
  [[nodiscard]] bool should_open() const;
  [[nodiscard]] std::uint64_t price_bytes() const;
  [[nodiscard]] bool is_next_due() const;
  void open_session(TeamOutput& output);
  [[nodiscard]] TeamFrame choose_frame(const Session& session) const;
  void announce(TeamOutput& output);
  [[nodiscard]] bool well_formed(const Session& session) const;
  [[nodiscard]] bool accepts(const Session& session) const;
  void consider(const Session& session);

  // The session that this robot is in.
  bool join(const Session& session);
  [[nodiscard]] std::optional<FrozenPart> freeze(const Session& session) const;
  void set_start(const Session& session, SessionGraph& graph);
  [[nodiscard]] const DecidedSolution& relaxed_own_start(const Session& session,
                                                         SessionGraph graph);
  [[nodiscard]] bool expects_false() const {
    return config_.robust && config_.method == PgoMethod::kNewton;
  }
  [[nodiscard]] std::size_t known_closures() const;
  [[nodiscard]] std::size_t closures_inside() const;
  void refine_alone();
  void advance(TeamOutput& output);
  void publish_poses(TeamOutput& output);
  void conclude(TeamOutput& output);
  void leave(bool with_solution);
  // Poses that a member has sent in the session of part_ at `stage` or later.
  [[nodiscard]] const MemberPoses* poses_of(RobotId robot, MemberStage stage) const {
    return part_->poses_of(roster_.public_poses(), robot, stage);
  }
  [[nodiscard]] bool all_solved() const { return part_->all_solved(roster_.public_poses()); }
  [[nodiscard]] bool misses_member(const SessionPlan& plan) const;
  [[nodiscard]] bool has_failed() const;
  void decide(const std::vector<WeighedClosure>& verdicts);
  void decide_with(const MemberPoses& poses);

  // Results.
  [[nodiscard]] std::map<KeyframeId, SE3> held_poses(const SE3& T_world_frame) const;
  [[nodiscard]] std::optional<World> world_of(RobotId anchor) const;
  [[nodiscard]] std::optional<World> tied_world() const;
  [[nodiscard]] bool is_located() const;
  [[nodiscard]] bool is_tied_to_earlier_runs() const;
  [[nodiscard]] std::uint64_t own_datum() const;
  [[nodiscard]] std::uint64_t datum_of(RobotId robot) const;
  [[nodiscard]] std::optional<RobotId> robot_in_datum() const;
  [[nodiscard]] std::optional<World> world_of_datum() const;
  [[nodiscard]] std::optional<FixesState> fixes_state() const;
  void publish(TeamOutput& output);
  [[nodiscard]] Objective objective() const;
  [[nodiscard]] OptimizerProgress make_progress() const;
  [[nodiscard]] bool holds_all(const SessionPlan& plan) const;

  PoseGraphConfig config_;
  TeamPeer self_;
  MemberSolverFactory factory_;
  OwnGraph graph_;
  std::uint64_t map_id_ = 0;           // 0: the run does not begin in a finished map
  std::size_t awaited_keyframes_ = 1;  // nothing is optimised before
  LinksReport links_;
  std::map<RobotId, std::uint64_t> direct_;  // boot ids of the robots that are received directly
  TeamRoster roster_;
  StatusSchedule status_schedule_;
  TeamNotices notices_;

  SessionPlan plan_;  // from the present knowledge
  bool plan_outdated_ = true;
  SessionSchedule schedule_;
  FrameTies ties_;                     // between the members of the plan
  std::optional<SessionPlan> solved_;  // plan of the last session of several robots with a solution

  OwnFrame frame_;
  OwnPoses poses_;
  // The start of this robot in a session, and what it follows from.
  struct Relaxed {
    std::uint32_t revision = 0;
    bool upright = false;
    bool alone = false;  // in a session of one robot
    DecidedSolution start = {};
  };
  std::optional<Relaxed> relaxed_;
  std::optional<RobotId> solution_anchor_;  // anchor of the last session with a solution
  FixPlacement placement_;                  // in the present or last session
  ClosureDecisions decisions_;
  RefinementSchedule refinement_;
  std::optional<SessionPart> part_;
  SessionState state_ = SessionState::kNone;  // state of the session of part_
  Objective objective_before_;                // in the session before
  std::uint32_t rounds_before_ = 0;           // rounds of earlier sessions
  double optimising_s_ = 0.0;                 // in earlier sessions
  std::uint64_t sent_bytes_ = 0;              // for sessions

  bool publish_due_ = false;
  std::optional<RobotId> published_anchor_;
  double now_s_ = 0.0;
  double session_sent_s_ = -1e9;
};

}  // namespace km
