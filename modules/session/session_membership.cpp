#include <algorithm>
#include <utility>

#include "modules/robust/lone_solution.hpp"
#include "modules/session/agent_state.hpp"
#include "modules/session/team_plan.hpp"

// The session that this robot is in.

namespace km {
namespace {

// The first of `keyframes`, which are ascending, in every run.
std::vector<KeyframeIndex> first_in_runs(std::span<const KeyframeIndex> runs,
                                         std::span<const KeyframeIndex> keyframes) {
  std::vector<KeyframeIndex> first;
  for (const KeyframeIndex run : runs) {
    const auto found = std::ranges::lower_bound(keyframes, run);
    if (found != keyframes.end() && (first.empty() || first.back() != *found))
      first.push_back(*found);
  }
  return first;
}

bool misses_member(const AgentState& s, const SessionPlan& plan) {
  return std::any_of(plan.members.begin(), plan.members.end(),
                     [&](const SessionMember& member) { return !s.roster.in_reach(member.peer); });
}

bool has_failed(const AgentState& s) {
  const auto failed = [&](RobotId robot) {
    return robot == s.self.robot ? s.part->stage() == MemberStage::kFailed
                                 : s.poses_of(robot, MemberStage::kFailed) != nullptr;
  };
  return std::any_of(s.part->members().begin(), s.part->members().end(), failed);
}

void decide(AgentState& s, const std::vector<WeighedClosure>& verdicts) {
  s.decisions.decide(verdicts);
  s.plan_outdated = true;
}

// Without a solution of all members, the result of the last session remains.
void leave(AgentState& s, bool with_solution) {
  s.part->end(with_solution);
  s.plan_outdated = true;
  if (!with_solution) return;
  s.publish_due = true;
  const Session& session = s.part->session();
  const SessionResult& result = s.part->result();
  s.poses.set(result.poses, result.covariances);
  s.frame = session.plan.frame;
  s.decisions.begin_result(s.part->members());
  decide(s, result.verdicts.closures);
  for (const RobotId member : s.part->members())
    if (const MemberPoses* published = s.poses_of(member, MemberStage::kSolved)) {
      s.roster.keep_result(member);
      if (member != s.self.robot) decide_with(s, *published);
    }
  s.world = session.T_frame_world ? World{session.anchor, *session.T_frame_world}
                                  : world_of(s, session.anchor);
  s.solution_anchor = session.anchor;
  if (session.plan.members.size() > 1) s.solved = session.plan;
  s.notices.closures(result.noise);
}

void publish_poses(AgentState& s, TeamOutput& output) {
  MemberPoses message{.sender = s.self, .session = s.part->session().id};
  message.stage = *s.part->stage();
  message.frame = s.part->session().plan.frame;
  message.step_precision = s.graph.mean_step_precision();
  message.odometry_precision = s.graph.odometry_noise().corrected({});
  message.closure_precision = s.graph.odometry_noise().corrected_closure({});
  message.keyframes = s.part->public_keyframes();
  message.later_runs = first_in_runs(s.graph.later_runs(), message.keyframes);
  message.T_frame_kf = s.part->public_poses();
  for (const WeighedClosure& verdict : s.part->result().verdicts.closures)
    if (verdict.id.from.robot != verdict.id.to.robot) message.verdicts.push_back(verdict);
  message.sent_bytes = s.part->cost().sent_bytes;
  for (const TeamMessage& unsent : output.messages)
    if (const auto* reliable = std::get_if<ReliableMessage>(&unsent); reliable && reliable->bytes)
      message.sent_bytes += reliable->bytes->size();
  s.roster.take(message);
  const bool concerns_others = s.part->members().size() > 1 || message.keyframes.size() > 1;
  if (concerns_others) output.messages.emplace_back(std::move(message));
}

// Ends the session if the poses received from the members allow it.
void conclude(AgentState& s, TeamOutput& output) {
  Session& session = s.part->session();
  const bool coordinates = session.id.coordinator == s.self;
  if (s.all_solved() && coordinates) {
    const SolverState state = s.part->progress();
    session.round = state.round;
    session.cost = state.cost;
    session.gradient = state.gradient;
    session.finished = true;
    leave(s, true);
    if (s.world) session.T_frame_world = s.world->T_frame_world;
    announce(s, output);
  } else if (has_failed(s)) {
    session.finished = coordinates;
    if (coordinates) announce(s, output);
    leave(s, false);
  } else if (misses_member(s, session.plan)) {
    leave(s, s.all_solved());
  }
}

bool accepts(const AgentState& s, const Session& session) {
  // A robot joins a session only once: the other members could not distinguish its new messages
  // from those before it left.
  if (session.id.number <= s.roster.find(session.id.coordinator.robot)->joined) return false;
  // Keyframe 0 of this robot is the origin of its own datum only, whatever the coordinator claims.
  for (const SessionMember& member : session.plan.members)
    if (member.peer == s.self && member.datum != 0 && member.datum != own_datum(s)) return false;
  if (!s.part) return true;
  const SessionId& running = s.part->session().id;
  if (session.id.coordinator == running.coordinator) return true;
  return session.id.coordinator.robot <= running.coordinator.robot ||
         !s.plan.has_member(running.coordinator.robot);
}

std::optional<FrozenPart> freeze(const AgentState& s, const Session& session) {
  std::vector<RobotId> peers;
  for (const auto& [robot, peer] : s.roster.peers()) peers.push_back(robot);
  auto part = freeze_part(session, s.self.robot, s.graph, peers, s.roster.results());
  if (!part) return std::nullopt;
  part->in_frame = session.plan.members.front().peer == s.self;
  part->closures_may_be_false = s.expects_false();
  // A robot out of reach takes its evidence on false closures with it: closures to it that no
  // session has kept wait for its return.
  if (s.expects_false())
    std::erase_if(part->graph.to_absent, [&](const PoseEdge& e) {
      const auto decided = s.decisions.decided().find(e.id());
      return decided == s.decisions.decided().end() || !decided->second;
    });
  return part;
}

const DecidedSolution& relaxed_own_start(AgentState& s, const Session& session,
                                         SessionGraph graph) {
  const std::uint32_t revision = s.graph.revision();
  const bool alone = session.plan.members.size() == 1;
  const bool fixed = !graph.fixes.empty();
  const bool known = !fixed && s.relaxed && s.relaxed->revision == revision &&
                     s.relaxed->upright == session.upright && s.relaxed->alone == alone;
  if (known) return s.relaxed->start;
  s.relaxed = {revision, session.upright, alone, {graph.start, {}}};
  DecidedSolution& start = s.relaxed->start;
  for (auto* edges : {&graph.between, &graph.to_absent, &graph.datum_ties}) edges->clear();
  const TreeNewtonOptions options{.dimension = s.graph.dimension(), .barc = s.config.barc};
  if (auto all_true = fixed ? std::nullopt : solution_if_all_true(graph, options))
    start.poses = *std::move(all_true);
  else if (!alone)
    start.poses = relaxed_start(std::move(graph), options);
  else if (auto one_by_one = fixed ? std::nullopt : solution_one_by_one(graph, options))
    start = *std::move(one_by_one);
  return start;
}

// The start follows from the measurements of this robot alone. Only the place of the first member
// in a frame that the session continues is that of the last result.
void set_start(AgentState& s, const Session& session, SessionGraph& graph) {
  graph.start = own_start(s.graph, s.self.robot, !s.expects_false());
  // Until the fixes determine the absolute frame, keyframe 0 stays, and no fix is an edge.
  if (!s.graph.fixes().empty()) {
    s.placement = place_fixes(s.graph.fixes(), graph.start, s.graph.mean_step_precision(),
                              session.upright && s.graph.verticals().size() > 1);
    if (s.placement.state.located) {
      graph.start.front() = s.placement.T_frame_datum;
      graph.fixes = fix_edges(s.graph.fixes(), s.placement.kept, graph.start);
    }
  }
  if (s.expects_false()) {
    const DecidedSolution& relaxed = relaxed_own_start(s, session, graph);
    graph.start = relaxed.poses;
    graph.decided = relaxed.decided;
  }
  if (session.plan.frame != session.id && session.plan.members.front().peer == s.self) {
    const SE3 T_frame_start = s.poses.T_frame_kf().front() * graph.start.front().inverse();
    for (SE3& T : graph.start) T = T_frame_start * T;
  }
}

// Number of closures of this robot in the newest sets of edges.
std::size_t known_closures(const AgentState& s) {
  std::size_t closures = s.closures_inside();
  for (const auto& [robot, peer] : s.roster.peers()) closures += s.graph.newest_edges(robot).size();
  return closures;
}

}  // namespace

void decide_with(AgentState& s, const MemberPoses& poses) {
  if (poses.session != s.part->session().id || poses.stage != MemberStage::kSolved) return;
  std::vector<WeighedClosure> of_both;
  for (const WeighedClosure& verdict : poses.verdicts)
    if (std::minmax(verdict.id.from.robot, verdict.id.to.robot) ==
            std::minmax(s.self.robot, poses.sender.robot) &&
        s.part->joins_members(verdict.id))
      of_both.push_back(verdict);
  decide(s, of_both);
}

bool join(AgentState& s, const Session& session) {
  if (s.graph.keyframes() == 0) return false;
  if (s.config.robust) {
    s.graph.judge_odometry(s.config.correct_odometry);
    s.notices.odometry(s.graph.odometry_noise());
    s.notices.breaks(s.graph.odometry_breaks());
  }
  auto part = freeze(s, session);
  if (!part) return false;
  if (s.in_session()) leave(s, s.all_solved());
  const bool continues = session.plan.frame != session.id;
  if (continues && part->in_frame && session.plan.frame != s.frame) return false;
  if (s.part) {
    s.objective_before = objective(s);
    s.rounds_before += s.part->progress().round;
    s.optimising_s += s.part->cost().last_activity_s - s.part->cost().started_s;
  }
  s.poses.extend(s.graph, s.self.robot);
  set_start(s, session, part->graph);
  s.refinement.used(known_closures(s));
  s.part.emplace(session, s.self, std::move(*part), s.factory, s.now_s);
  if (s.roster.find(session.id.coordinator.robot) != nullptr)
    s.roster.at(session.id.coordinator.robot).joined = session.id.number;
  s.deserted = false;
  return true;
}

void consider(AgentState& s, const Session& session) {
  if (s.part && session.id == s.part->session().id) {
    // If this robot has left because a member seemed to be lost, all members completed the session
    // nevertheless.
    if (s.part->follow(session) && !s.is_solved())
      leave(s, s.part->stage() == MemberStage::kSolved && !has_failed(s));
    return;
  }
  const auto& members = session.plan.members;
  const bool member = std::any_of(members.begin(), members.end(),
                                  [&](const SessionMember& m) { return m.peer == s.self; });
  const bool from_own_coordinator = s.in_session() &&
                                    session.id.coordinator == s.part->session().id.coordinator &&
                                    s.part->session().id.number < session.id.number;
  // The other members continue without this robot.
  if (from_own_coordinator && !member) return leave(s, s.all_solved());
  // This robot joins only if all members are in reach, and if links and closures that it knows
  // connect it to the coordinator (`plan`).
  if (!member || session.finished || !accepts(s, session) || misses_member(s, session.plan) ||
      !s.plan.has_member(session.id.coordinator.robot) || join(s, session))
    return;
  // consider() runs again with every new message, but counts the refusal only once.
  const RobotId coordinator = session.id.coordinator.robot;
  if (std::exchange(s.roster.at(coordinator).missed, session.id.number) != session.id.number)
    s.notices.refuse("a session of robot " + std::to_string(coordinator) +
                     " over closures that are not at hand");
}

void advance(AgentState& s, TeamOutput& output) {
  if (!s.in_session()) return;
  const auto stage = s.part->stage();
  SessionWork work = s.part->advance(s.roster.public_poses(), s.now_s);
  for (ReliableMessage& message : work.messages) {
    if (message.bytes) s.notices.message(message.bytes->size());
    output.messages.emplace_back(std::move(message));
  }
  for (const RobotId sender : work.refused)
    s.notices.refuse("a message of robot " + std::to_string(sender) + " that is of no use");
  output.more |= work.any;
  if (s.part->stage() != stage) {
    output.more = true;
    if (s.part->stage() == MemberStage::kFailed)
      s.notices.add("session " + std::to_string(s.part->session().id.number) + " of robot " +
                    std::to_string(s.part->session().id.coordinator.robot) +
                    " cannot be solved: " + s.part->result().failure);
    publish_poses(s, output);
  }
  if (s.in_session()) conclude(s, output);
}

// Odometry since the last session drifts, and the next session may be minutes away. The graph is
// that of a session without the other robots, whose last poses are held. Nothing is decided: the
// next session weighs all closures. Fixes wait for it, because it places their frame.
void refine_alone(AgentState& s) {
  const std::size_t closures = known_closures(s);
  if (!s.refinement.is_due(closures, s.now_s) || !s.is_solved() || !s.expects_false() ||
      !s.graph.fixes().empty())
    return;
  Session alone;
  alone.plan.frame = s.frame;
  alone.plan.members.emplace_back().peer = s.self;
  alone.upright = s.part->session().upright;
  alone.anchor = s.self.robot;
  auto part = freeze(s, alone);
  if (!part) return;
  s.refinement.began(closures, s.now_s);
  s.poses.extend(s.graph, s.self.robot);
  SessionGraph& graph = part->graph;
  graph.start = s.poses.T_frame_kf();
  graph.again = true;
  graph.decided = s.decisions.decided();
  graph.noise = s.part->result().noise;
  s.poses.set(
      relaxed_start(std::move(graph), {.dimension = s.graph.dimension(), .barc = s.config.barc}));
  s.publish_due = true;
}

}  // namespace km
