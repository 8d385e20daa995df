#include <algorithm>
#include <utility>

#include "modules/session/agent_state.hpp"
#include "modules/session/team_plan.hpp"

// Plans, and the sessions that this robot coordinates.

namespace km {
namespace {

// Longest patience with a session: as long as a step of a robot may take.
constexpr double kMostPatience_s = 120.0;

bool same_members(const SessionPlan& x, const SessionPlan& y) {
  return x.members.size() == y.members.size() && !has_lost_member(x, y);
}

void make_plan(AgentState& s) {
  const std::map<RobotId, TeamStatus> statuses = s.roster.statuses(make_status(s));
  SessionPlan plan = plan_session(statuses, s.self.robot);
  // If the anchor leaves while no closure ties this robot to it, it stays in another frame.
  if (s.world && !plan.has_member(s.world->anchor)) s.world = tied_world(s);
  const bool graph_changed = !same_graph(plan, s.plan);
  const std::uint64_t closures =
      plan.members.size() == 1 ? s.closures_inside() : closures_between(plan, statuses);
  s.plan = std::move(plan);
  for (const auto& [robot, status] : statuses)
    if (const auto own = datum_of(s, s.self.robot);
        own != 0 && status.datum != 0 && status.datum != own)
      s.notices.other_datum(robot);
  std::vector<RobotId> members;
  for (const SessionMember& member : s.plan.members) members.push_back(member.peer.robot);
  std::ranges::sort(members);
  s.ties = frame_ties(s.self.robot, members,
                      find_ties(statuses, s.solved && s.expects_false() ? &*s.solved : nullptr));
  s.schedule.update(graph_changed, closures, s.ties == FrameTies{}, s.now_s);
  // While a session decides, the ties are not yet judged.
  if (s.is_solved()) s.notices.ties(s.ties);
}

bool all_upright(const AgentState& s, const SessionPlan& plan) {
  return std::all_of(plan.members.begin(), plan.members.end(), [&](const SessionMember& member) {
    return member.peer == s.self ? s.graph.upright()
                                 : s.roster.find(member.peer.robot)->status->upright;
  });
}

// Bytes of the member that has sent most in the last session, because the budget applies to every
// robot.
std::uint64_t price_bytes(const AgentState& s) {
  std::uint64_t most = s.part->cost().sent_bytes;
  for (const RobotId member : s.part->members())
    if (const MemberPoses* published = s.poses_of(member, MemberStage::kSolved))
      most = std::max(most, published->sent_bytes);
  return most;
}

bool is_next_due(const AgentState& s) {
  if (!s.schedule.is_within_budget(price_bytes(s), s.part->cost().last_activity_s, s.now_s))
    return false;
  const bool costs_nothing = s.plan.members.size() == 1 && s.closures_inside() == 0;
  return costs_nothing || !same_members(s.part->session().plan, s.plan) ||
         s.schedule.is_worthwhile(s.part->cost().last_activity_s, s.now_s);
}

// True if a member of the plan has been in another session since the last one.
bool has_moved_on(const AgentState& s) {
  return std::ranges::any_of(s.plan.members, [&](const SessionMember& member) {
    return member.peer != s.self && s.poses_of(member.peer.robot, MemberStage::kEntered) == nullptr;
  });
}

bool is_hopeless(const AgentState& s) {
  return s.in_session() && s.now_s - s.part->cost().last_activity_s > s.patience_s;
}

bool should_open(const AgentState& s) {
  if (!s.part) return true;
  const Session& session = s.part->session();
  const bool stalled = (s.in_session() && s.deserted) || is_hopeless(s);
  // A member that leaves takes no measurement back: the solution with it remains.
  if (same_graph(session.plan, s.plan) || (s.is_solved() && has_nothing_new(session.plan, s.plan)))
    return session.finished ? has_moved_on(s) : !s.in_session() || stalled;
  if (session.id.coordinator != s.self || has_lost_member(session.plan, s.plan)) return true;
  return s.in_session() ? stalled : !session.finished || is_next_due(s);
}

// A session begins a new frame, so that its start does not depend on earlier sessions. It continues
// the frame of its first member only to hold the poses of robots out of reach in it.
TeamFrame choose_frame(const AgentState& s, const Session& session) {
  const PublicPoses& results = s.roster.results();
  const RobotId first = session.plan.members.front().peer.robot;
  const auto of_first = results.find(first);
  if (first != s.self.robot && of_first == results.end()) return session.id;
  const TeamFrame& frame = first == s.self.robot ? s.frame : of_first->second.frame;
  const bool holds = std::ranges::any_of(results, [&](const auto& result) {
    return result.second.frame == frame && !session.plan.has_member(result.first);
  });
  return holds ? frame : session.id;
}

void open_session(AgentState& s, TeamOutput& output) {
  Session session{.id = {s.self, s.schedule.take_number()}, .plan = s.plan};
  plan_tree(session.plan, s.roster.statuses(make_status(s)), s.links.links);
  session.method = s.config.method;
  session.upright = all_upright(s, s.plan);
  session.max_rounds = static_cast<std::uint32_t>(s.config.max_rounds);
  session.plan.frame = choose_frame(s, session);
  session.anchor = coordinator_of(s.plan);
  // `world` keeps its place when its robot is no longer a member.
  const std::optional<World>& world = s.world;
  if (world && world->anchor < session.anchor && s.frame == session.plan.frame) {
    session.anchor = world->anchor;
    session.T_frame_world = world->T_frame_world;
  }
  if (!join(s, session)) return;
  s.schedule.opened();
  announce(s, output);
}

}  // namespace

TeamStatus make_status(AgentState& s) {
  std::vector<EdgeSetOffer> offers = s.graph.offers();
  for (EdgeSetOffer& offer : offers)
    s.decisions.count_places(offer, *s.graph.edges(offer.peer, offer.id),
                             s.graph.alignments(offer.peer));
  return {.sender = s.self,
          .keyframes = s.graph.keyframes(),
          .revision = s.graph.revision(),
          .offers = std::move(offers),
          .method = s.config.method,
          .T_odom_first = s.graph.T_odom_first(),
          .upright = s.graph.upright(),
          .datum = datum_of(s, s.self.robot)};
}

void announce(AgentState& s, TeamOutput& output) {
  Session& session = s.part->session();
  s.session_sent_s = s.now_s;
  if (!session.finished) {
    const SolverState state = s.part->progress();
    session.round = state.round;
    session.cost = state.cost;
    session.gradient = state.gradient;
  }
  if (s.part->members().size() > 1) output.messages.emplace_back(session);
}

void coordinate(AgentState& s, TeamOutput& output) {
  if (std::exchange(s.plan_outdated, false)) {
    make_plan(s);
    for (const auto& [robot, peer] : s.roster.peers())
      if (peer.session && s.roster.in_reach(peer.session->id.coordinator))
        consider(s, *peer.session);
  }
  if (coordinator_of(s.plan) != s.self.robot) return;
  if (should_open(s)) {
    // The next session takes slow members as long, also this robot itself.
    if (is_hopeless(s)) s.patience_s = std::min(2.0 * s.patience_s, kMostPatience_s);
    open_session(s, output);
  }
  const bool due = s.now_s - s.session_sent_s >= kTeamStatusPeriod_s;
  if (s.in_session() && s.part->session().id.coordinator == s.self && due) announce(s, output);
}

}  // namespace km
