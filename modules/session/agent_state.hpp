#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/data/closure_verdicts.hpp"
#include "modules/core/data/team_links.hpp"
#include "modules/core/data/team_solution.hpp"
#include "modules/robust/fix_placement.hpp"
#include "modules/robust/lone_solution.hpp"
#include "modules/session/closure_decisions.hpp"
#include "modules/session/frame_ties.hpp"
#include "modules/session/own_graph.hpp"
#include "modules/session/own_poses.hpp"
#include "modules/session/session_part.hpp"
#include "modules/session/session_schedule.hpp"
#include "modules/session/team_notices.hpp"
#include "modules/session/team_roster.hpp"

namespace km {

/// Outputs of a step of the agent, to other robots and to its own robot.
struct [[nodiscard]] TeamOutput {
  std::vector<TeamMessage> messages = {};
  std::optional<Trajectory> trajectory = {};
  std::optional<OptimizerProgress> progress = {};
  std::optional<ClosureVerdicts> verdicts = {};  ///< After a session.
  std::vector<std::string> notices = {};         ///< Messages for a person: faults and doubts.
  std::vector<std::string> news = {};            ///< Messages for a person: ends of doubts.
  bool more = false;  ///< The next step has work even without further input.
};

/// Pose of `world`, the frame in which robots publish, in the frame of a solution. `world` is the
/// odometry frame of `anchor`.
struct World {
  RobotId anchor = 0;
  SE3 T_frame_world = SE3::Identity();
};

/// The cost of a session and its gradient, see SolverState.
struct Objective {
  double cost = 0.0;
  double gradient = 0.0;
};

/// The start of a robot in a session, and what it follows from.
struct RelaxedStart {
  std::uint32_t revision = 0;
  bool upright = false;
  bool alone = false;  ///< In a session of one robot.
  DecidedSolution start = {};
};

/// All that a TeamAgent knows. Three files work on it: session_opening.cpp (plans, and sessions
/// that this robot coordinates), session_membership.cpp (the session that this robot is in), and
/// session_output.cpp (what it sends to its own robot).
struct AgentState {
  AgentState(const PoseGraphConfig& of_agent, TeamPeer peer, MemberSolverFactory solvers,
             int dimension)
      : config(checked(of_agent)),
        self(peer),
        factory(std::move(solvers)),
        graph(peer.robot, dimension),
        roster(peer, config.method),
        notices(peer.robot),
        schedule(config),
        frame{.coordinator = peer},
        refinement(config.refinement_period_s) {}

  PoseGraphConfig config;
  TeamPeer self;
  MemberSolverFactory factory;
  OwnGraph graph;
  std::uint64_t map_id = 0;           ///< 0: the run does not begin in a finished map.
  std::size_t awaited_keyframes = 1;  ///< Nothing is optimised before.
  LinksReport links = {};
  std::map<RobotId, std::uint64_t> direct = {};  ///< Boot ids of robots that are received directly.
  TeamRoster roster;
  StatusSchedule status_schedule = {};
  TeamNotices notices;

  SessionPlan plan = {};  ///< From the present knowledge.
  bool plan_outdated = true;
  SessionSchedule schedule;
  FrameTies ties = {};  ///< Between the members of the plan.
  std::optional<SessionPlan> solved =
      {};  ///< Plan of the last session of several robots with a solution.

  std::optional<SessionPart> part = {};  ///< In the present or last session.
  bool deserted = false;                 ///< A member of the session has joined another one.
  std::optional<RelaxedStart> relaxed = {};
  Objective objective_before = {};  ///< In the session before.
  std::uint32_t rounds_before = 0;  ///< Sum over earlier sessions.
  double optimising_s = 0.0;        ///< In earlier sessions.
  std::uint64_t sent_bytes = 0;     ///< For sessions.

  TeamFrame frame;                  ///< The frame of `poses`.
  std::optional<World> world = {};  ///< Unknown before the first solution.
  OwnPoses poses = {};
  std::optional<RobotId> solution_anchor = {};  ///< Anchor of the last session with a solution.
  FixPlacement placement = {};                  ///< In the present or last session.
  ClosureDecisions decisions = {};
  RefinementSchedule refinement;
  bool publish_due = false;
  std::optional<RobotId> published_anchor = {};
  double now_s = 0.0;
  double patience_s = 15.0;  // a session without progress for this time is replaced
  double session_sent_s = -1e9;

  [[nodiscard]] bool in_session() const { return part && is_running(part->state()); }
  /// True if the last session has ended with a solution of all members.
  [[nodiscard]] bool is_solved() const { return part && part->state() == SessionState::kDone; }
  [[nodiscard]] bool expects_false() const {
    return config.robust && config.method == PgoMethod::kNewton;
  }
  /// Poses that a member has sent in the session of `part` at `stage` or later.
  [[nodiscard]] const MemberPoses* poses_of(RobotId robot, MemberStage stage) const {
    return part->poses_of(roster.public_poses(), robot, stage);
  }
  [[nodiscard]] bool all_solved() const { return part->all_solved(roster.public_poses()); }
  [[nodiscard]] std::size_t closures_inside() const {
    return graph.newest_edges(self.robot).size();
  }
};

// session_opening.cpp

[[nodiscard]] TeamStatus make_status(AgentState& s);
/// Makes the plan if it is outdated, and opens and announces sessions if this robot coordinates.
void coordinate(AgentState& s, TeamOutput& output);
/// Sends the progress of the session of this robot to its members.
void announce(AgentState& s, TeamOutput& output);

// session_membership.cpp

/// Joins, follows or leaves a session by a message of its coordinator.
void consider(AgentState& s, const Session& session);
[[nodiscard]] bool join(AgentState& s, const Session& session);
/// Takes the verdicts of a member on closures to this robot, which are valid for both.
void decide_with(AgentState& s, const MemberPoses& poses);
/// Does one piece of work of the session.
void advance(AgentState& s, TeamOutput& output);
/// Refines the own poses between sessions, if that is due.
void refine_alone(AgentState& s);

// session_output.cpp

/// Identity of the datum of which keyframe 0 is the origin, located or not; 0: there is none.
[[nodiscard]] std::uint64_t own_datum(const AgentState& s);
/// Identity of the datum in which a robot is located; 0: it is not located.
[[nodiscard]] std::uint64_t datum_of(const AgentState& s, RobotId robot);
/// `world` with this anchor. It follows from the pose of keyframe 0 that the anchor has sent to all
/// robots, so all compute the same `world` to the last bit. nullopt if the poses of the anchor are
/// unknown or in another frame.
[[nodiscard]] std::optional<World> world_of(const AgentState& s, RobotId anchor);
/// The frame in which this robot publishes. If no closure ties it to the anchor of the session,
/// this is the frame of the lowest robot that closures tie to it.
[[nodiscard]] std::optional<World> tied_world(const AgentState& s);
[[nodiscard]] Objective objective(const AgentState& s);
[[nodiscard]] OptimizerProgress make_progress(const AgentState& s);
void publish(AgentState& s, TeamOutput& output);

}  // namespace km
