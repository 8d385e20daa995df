#include <algorithm>
#include <utility>

#include "modules/robust/lone_solution.hpp"
#include "modules/session/team_agent.hpp"
#include "modules/session/team_plan.hpp"

// Sessions: how they are opened, and how this robot joins and leaves them.

namespace km {
namespace {

// Status periods without progress after which a session is replaced.
constexpr double kHopelessPeriods = 15.0;

bool same_members(const SessionPlan& x, const SessionPlan& y) {
  return x.members.size() == y.members.size() && !has_lost_member(x, y);
}

}  // namespace

// Plans and sessions that this robot coordinates.

void TeamAgent::make_plan() {
  const std::map<RobotId, TeamStatus> statuses = roster_.statuses(make_status());
  SessionPlan plan = plan_session(statuses, self_.robot);
  // If the anchor leaves while no closure ties this robot to it, it stays in another frame.
  if (frame_.world() && !plan.has_member(frame_.world()->anchor)) frame_.set_world(tied_world());
  const bool graph_changed = !same_graph(plan, plan_);
  const std::uint64_t closures =
      plan.members.size() == 1 ? closures_inside() : closures_between(plan, statuses);
  plan_ = std::move(plan);
  for (const auto& [robot, status] : statuses)
    if (const auto own = datum_of(self_.robot);
        own != 0 && status.datum != 0 && status.datum != own)
      notices_.other_datum(robot);
  std::vector<RobotId> members;
  for (const SessionMember& member : plan_.members) members.push_back(member.peer.robot);
  std::ranges::sort(members);
  ties_ = frame_ties(self_.robot, members,
                     find_ties(statuses, solved_ && expects_false() ? &*solved_ : nullptr));
  schedule_.update(graph_changed, closures, ties_ == FrameTies{}, now_s_);
  // While a session decides, the ties are not yet judged.
  if (state_ == SessionState::kSolved) notices_.ties(ties_);
}

void TeamAgent::coordinate(TeamOutput& output) {
  if (std::exchange(plan_outdated_, false)) {
    make_plan();
    for (const auto& [robot, peer] : roster_.peers())
      if (peer.session && roster_.in_reach(peer.session->id.coordinator)) consider(*peer.session);
  }
  if (coordinator_of(plan_) != self_.robot) return;
  if (should_open()) open_session(output);
  const bool due = now_s_ - session_sent_s_ >= kTeamStatusPeriod_s;
  if (in_session() && part_->session().id.coordinator == self_ && due) announce(output);
}

void TeamAgent::announce(TeamOutput& output) {
  Session& session = part_->session();
  session_sent_s_ = now_s_;
  if (!session.finished) {
    const SolverState state = part_->state();
    session.round = state.round;
    session.cost = state.cost;
    session.gradient = state.gradient;
  }
  if (part_->members().size() > 1) output.messages.emplace_back(session);
}

bool TeamAgent::all_upright(const SessionPlan& plan) const {
  return std::all_of(plan.members.begin(), plan.members.end(), [&](const SessionMember& member) {
    return member.peer == self_ ? graph_.upright()
                                : roster_.find(member.peer.robot)->status->upright;
  });
}

// Bytes of the member that has sent most in the last session, because the budget applies to every
// robot.
std::uint64_t TeamAgent::price_bytes() const {
  std::uint64_t most = part_->sent_bytes();
  for (const RobotId member : part_->members())
    if (const MemberPoses* published = poses_of(member, MemberStage::kSolved))
      most = std::max(most, published->sent_bytes);
  return most;
}

bool TeamAgent::is_next_due() const {
  if (!schedule_.is_within_budget(price_bytes(), part_->last_activity_s(), now_s_)) return false;
  const bool costs_nothing = plan_.members.size() == 1 && closures_inside() == 0;
  return costs_nothing || !same_members(part_->session().plan, plan_) ||
         schedule_.is_worthwhile(part_->last_activity_s(), now_s_);
}

// True if a member has been in another session since the last one.
bool TeamAgent::has_moved_on() const {
  const auto elsewhere = [&](RobotId robot) {
    return robot != self_.robot && poses_of(robot, MemberStage::kEntered) == nullptr;
  };
  return std::any_of(part_->members().begin(), part_->members().end(), elsewhere);
}

bool TeamAgent::should_open() const {
  if (!part_) return true;
  const Session& session = part_->session();
  const bool hopeless = now_s_ - part_->last_activity_s() > kHopelessPeriods * kTeamStatusPeriod_s;
  const bool stalled = in_session() && (state_ == SessionState::kDeserted || hopeless);
  if (same_graph(session.plan, plan_))
    return session.finished ? has_moved_on() : !in_session() || stalled;
  if (session.id.coordinator != self_ || has_lost_member(session.plan, plan_)) return true;
  return in_session() ? stalled : !session.finished || is_next_due();
}

void TeamAgent::open_session(TeamOutput& output) {
  Session session{.id = {self_, schedule_.take_number()}, .plan = plan_};
  plan_tree(session.plan, roster_.statuses(make_status()), links_.links);
  session.method = config_.method;
  session.upright = all_upright(plan_);
  session.max_rounds = static_cast<std::uint32_t>(config_.max_rounds);
  session.plan.frame = choose_frame(session);
  session.anchor = coordinator_of(plan_);
  // `world` keeps its place when its robot is no longer a member.
  const std::optional<World>& world = frame_.world();
  if (world && world->anchor < session.anchor && frame_.frame() == session.plan.frame) {
    session.anchor = world->anchor;
    session.T_frame_world = world->T_frame_world;
  }
  if (!join(session)) return;
  schedule_.opened();
  announce(output);
}

// A session begins a new frame, so that its start does not depend on earlier sessions. It continues
// the frame of its first member only to hold the poses of robots out of reach in it.
TeamFrame TeamAgent::choose_frame(const Session& session) const {
  const PublicPoses& results = roster_.results();
  const RobotId first = session.plan.members.front().peer.robot;
  const auto of_first = results.find(first);
  if (first != self_.robot && of_first == results.end()) return session.id;
  const TeamFrame& frame = first == self_.robot ? frame_.frame() : of_first->second.frame;
  const bool holds = std::ranges::any_of(results, [&](const auto& result) {
    return result.second.frame == frame && !session.plan.has_member(result.first);
  });
  return holds ? frame : session.id;
}

// The session may come from a hostile robot: checks everything on which join() relies.
bool TeamAgent::well_formed(const Session& session) const {
  const SessionPlan& plan = session.plan;
  const auto known_pair = [&](const SessionPair& pair) {
    return pair.a < pair.b && plan.has_member(pair.a) && plan.has_member(pair.b);
  };
  return !plan.members.empty() && session.method == config_.method &&
         place_in(plan, plan.members.front().peer.robot) &&
         coordinator_of(plan) == session.id.coordinator.robot &&
         std::all_of(plan.pairs.begin(), plan.pairs.end(), known_pair) &&
         (!session.T_frame_world || session.T_frame_world->matrix().allFinite());
}

bool TeamAgent::accepts(const Session& session) const {
  // A robot joins a session only once: the other members could not distinguish its new messages
  // from those before it left.
  if (session.id.number <= roster_.find(session.id.coordinator.robot)->joined) return false;
  // Keyframe 0 of this robot is the origin of its own datum only, whatever the coordinator claims.
  for (const SessionMember& member : session.plan.members)
    if (member.peer == self_ && member.datum != 0 && member.datum != own_datum()) return false;
  if (!part_) return true;
  const SessionId& running = part_->session().id;
  if (session.id.coordinator == running.coordinator) return true;
  return session.id.coordinator.robot <= running.coordinator.robot ||
         !plan_.has_member(running.coordinator.robot);
}

void TeamAgent::consider(const Session& session) {
  if (part_ && session.id == part_->session().id) {
    // If this robot has left because a member seemed to be lost, all members completed the session
    // nevertheless.
    if (part_->follow(session) && state_ != SessionState::kSolved)
      leave(part_->stage() == MemberStage::kSolved && !has_failed());
    return;
  }
  const auto& members = session.plan.members;
  const bool member = std::any_of(members.begin(), members.end(),
                                  [&](const SessionMember& m) { return m.peer == self_; });
  const bool from_own_coordinator = in_session() &&
                                    session.id.coordinator == part_->session().id.coordinator &&
                                    part_->session().id.number < session.id.number;
  // The other members continue without this robot.
  if (from_own_coordinator && !member) return leave(all_solved());
  // This robot joins only if all members are in reach, and if links and closures that it knows
  // connect it to the coordinator (`plan_`).
  if (!member || session.finished || !accepts(session) || misses_member(session.plan) ||
      !plan_.has_member(session.id.coordinator.robot) || join(session))
    return;
  // consider() runs again with every new message, but counts the refusal only once.
  const RobotId coordinator = session.id.coordinator.robot;
  if (std::exchange(roster_.at(coordinator).missed, session.id.number) != session.id.number)
    refuse("a session of robot " + std::to_string(coordinator) +
           " over closures that are not at hand");
}

// The session that this robot is in.

std::optional<FrozenPart> TeamAgent::freeze(const Session& session) const {
  std::vector<RobotId> peers;
  for (const auto& [robot, peer] : roster_.peers()) peers.push_back(robot);
  auto part = freeze_part(session, self_.robot, graph_, peers, roster_.results());
  if (!part) return std::nullopt;
  part->in_frame = session.plan.members.front().peer == self_;
  part->closures_may_be_false = expects_false();
  return part;
}

bool TeamAgent::join(const Session& session) {
  if (graph_.keyframes() == 0) return false;
  if (config_.robust) {
    graph_.judge_odometry(config_.correct_odometry);
    notices_.odometry(graph_.odometry_noise());
    notices_.breaks(graph_.odometry_breaks());
  }
  auto part = freeze(session);
  if (!part) return false;
  if (in_session()) leave(all_solved());
  const bool continues = session.plan.frame != session.id;
  if (continues && part->in_frame && session.plan.frame != frame_.frame()) return false;
  if (part_) {
    objective_before_ = objective();
    rounds_before_ += part_->state().round;
    optimising_s_ += part_->last_activity_s() - part_->started_s();
  }
  poses_.extend(graph_, self_.robot);
  set_start(session, part->graph);
  refinement_.used(known_closures());
  part_.emplace(session, self_, std::move(*part), factory_, now_s_);
  if (roster_.find(session.id.coordinator.robot) != nullptr)
    roster_.at(session.id.coordinator.robot).joined = session.id.number;
  state_ = SessionState::kRunning;
  return true;
}

// The start follows from the measurements of this robot alone. Only the place of the first member
// in a frame that the session continues is that of the last result.
void TeamAgent::set_start(const Session& session, SessionGraph& graph) {
  graph.start = own_start(graph_, self_.robot, !expects_false());
  // Until the fixes determine the absolute frame, keyframe 0 stays, and no fix is an edge.
  if (!graph_.fixes().empty()) {
    placement_ = place_fixes(graph_.fixes(), graph.start, graph_.mean_step_precision(),
                             session.upright && graph_.verticals().size() > 1);
    if (placement_.state.located) {
      graph.start.front() = placement_.T_frame_datum;
      graph.fixes = fix_edges(graph_.fixes(), placement_.kept, graph.start);
    }
  }
  if (expects_false()) {
    const DecidedSolution& relaxed = relaxed_own_start(session, graph);
    graph.start = relaxed.poses;
    graph.decided = relaxed.decided;
  }
  if (session.plan.frame != session.id && session.plan.members.front().peer == self_) {
    const SE3 T_frame_start = poses_.T_frame_kf().front() * graph.start.front().inverse();
    for (SE3& T : graph.start) T = T_frame_start * T;
  }
  for (const PoseEdge& e : graph.to_absent)
    if (const auto decided = decisions_.decided().find(e.id());
        decided != decisions_.decided().end())
      graph.decided.insert(*decided);
}

const DecidedSolution& TeamAgent::relaxed_own_start(const Session& session, SessionGraph graph) {
  const std::uint32_t revision = graph_.revision();
  const bool alone = session.plan.members.size() == 1;
  const bool fixed = !graph.fixes.empty();
  const bool known = !fixed && relaxed_ && relaxed_->revision == revision &&
                     relaxed_->upright == session.upright && relaxed_->alone == alone;
  if (known) return relaxed_->start;
  relaxed_ = {revision, session.upright, alone, {graph.start, {}}};
  DecidedSolution& start = relaxed_->start;
  for (auto* edges : {&graph.between, &graph.to_absent, &graph.datum_ties}) edges->clear();
  const TreeNewtonOptions options{.dimension = graph_.dimension(), .barc = config_.barc};
  if (auto all_true = fixed ? std::nullopt : solution_if_all_true(graph, options))
    start.poses = *std::move(all_true);
  else if (!alone)
    start.poses = relaxed_start(std::move(graph), options);
  else if (auto one_by_one = fixed ? std::nullopt : solution_one_by_one(graph, options))
    start = *std::move(one_by_one);
  return start;
}

// Number of closures of this robot in the newest sets of edges.
std::size_t TeamAgent::known_closures() const {
  std::size_t closures = 0;
  const auto count = [&](RobotId robot) {
    if (const auto* edges = graph_.newest_edges(robot)) closures += edges->size();
  };
  count(self_.robot);
  for (const auto& [robot, peer] : roster_.peers()) count(robot);
  return closures;
}

std::size_t TeamAgent::closures_inside() const {
  const auto* inside = graph_.newest_edges(self_.robot);
  return inside == nullptr ? 0 : inside->size();
}

// Odometry since the last session drifts, and the next session may be minutes away. The graph is
// that of a session without the other robots, whose last poses are held. Nothing is decided: the
// next session weighs all closures. Fixes wait for it, because it places their frame.
void TeamAgent::refine_alone() {
  const std::size_t closures = known_closures();
  if (!refinement_.is_due(closures, now_s_) || state_ != SessionState::kSolved ||
      !expects_false() || !graph_.fixes().empty())
    return;
  Session alone;
  alone.plan.frame = frame_.frame();
  alone.plan.members.emplace_back().peer = self_;
  alone.upright = part_->session().upright;
  alone.anchor = self_.robot;
  auto part = freeze(alone);
  if (!part) return;
  refinement_.began(closures, now_s_);
  poses_.extend(graph_, self_.robot);
  SessionGraph& graph = part->graph;
  graph.start = poses_.T_frame_kf();
  graph.again = true;
  graph.decided = decisions_.decided();
  graph.noise = part_->noise();
  poses_.set(
      relaxed_start(std::move(graph), {.dimension = graph_.dimension(), .barc = config_.barc}));
  publish_due_ = true;
}

bool TeamAgent::misses_member(const SessionPlan& plan) const {
  return std::any_of(plan.members.begin(), plan.members.end(),
                     [&](const SessionMember& member) { return !roster_.in_reach(member.peer); });
}

bool TeamAgent::has_failed() const {
  const auto failed = [&](RobotId robot) {
    return robot == self_.robot ? part_->stage() == MemberStage::kFailed
                                : poses_of(robot, MemberStage::kFailed) != nullptr;
  };
  return std::any_of(part_->members().begin(), part_->members().end(), failed);
}

void TeamAgent::advance(TeamOutput& output) {
  if (!in_session()) return;
  const auto stage = part_->stage();
  for (ReliableMessage& message : part_->advance(roster_.public_poses(), now_s_)) {
    if (message.bytes) notices_.message(message.bytes->size());
    output.messages.emplace_back(std::move(message));
  }
  for (const RobotId sender : part_->take_refused())
    refuse("a message of robot " + std::to_string(sender) + " that is of no use");
  output.more |= part_->worked();
  if (part_->stage() != stage) {
    output.more = true;
    if (part_->stage() == MemberStage::kFailed)
      notices_.add("session " + std::to_string(part_->session().id.number) + " of robot " +
                   std::to_string(part_->session().id.coordinator.robot) +
                   " cannot be solved: " + part_->failure());
    publish_poses(output);
  }
  if (in_session()) conclude(output);
}

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

}  // namespace

void TeamAgent::publish_poses(TeamOutput& output) {
  MemberPoses message{.sender = self_, .session = part_->session().id};
  message.stage = *part_->stage();
  message.frame = part_->session().plan.frame;
  message.step_precision = graph_.mean_step_precision();
  message.keyframes = part_->public_keyframes();
  message.later_runs = first_in_runs(graph_.later_runs(), message.keyframes);
  message.T_frame_kf = part_->public_poses();
  for (const WeighedClosure& verdict : part_->verdicts().closures)
    if (verdict.id.from.robot != verdict.id.to.robot) message.verdicts.push_back(verdict);
  message.sent_bytes = part_->sent_bytes();
  for (const TeamMessage& unsent : output.messages)
    if (const auto* reliable = std::get_if<ReliableMessage>(&unsent); reliable && reliable->bytes)
      message.sent_bytes += reliable->bytes->size();
  roster_.take(message);
  const bool concerns_others = part_->members().size() > 1 || message.keyframes.size() > 1;
  if (concerns_others) output.messages.emplace_back(std::move(message));
}

void TeamAgent::decide(const std::vector<WeighedClosure>& verdicts) {
  decisions_.decide(verdicts);
  plan_outdated_ = true;
}

// The verdicts of a member on a closure are valid for both of its robots.
void TeamAgent::decide_with(const MemberPoses& poses) {
  if (poses.session != part_->session().id || poses.stage != MemberStage::kSolved) return;
  std::vector<WeighedClosure> of_both;
  for (const WeighedClosure& verdict : poses.verdicts)
    if (std::minmax(verdict.id.from.robot, verdict.id.to.robot) ==
            std::minmax(self_.robot, poses.sender.robot) &&
        part_->joins_members(verdict.id))
      of_both.push_back(verdict);
  decide(of_both);
}

// Ends the session if the poses received from the members allow it.
void TeamAgent::conclude(TeamOutput& output) {
  Session& session = part_->session();
  const bool coordinates = session.id.coordinator == self_;
  if (all_solved() && coordinates) {
    const SolverState state = part_->state();
    session.round = state.round;
    session.cost = state.cost;
    session.gradient = state.gradient;
    session.finished = true;
    leave(true);
    if (frame_.world()) session.T_frame_world = frame_.world()->T_frame_world;
    announce(output);
  } else if (has_failed()) {
    session.finished = coordinates;
    if (coordinates) announce(output);
    leave(false);
  } else if (misses_member(session.plan)) {
    leave(all_solved());
  }
}

// Without a solution of all members, the result of the last session remains.
void TeamAgent::leave(bool with_solution) {
  state_ = with_solution ? SessionState::kSolved : SessionState::kAbandoned;
  plan_outdated_ = true;
  if (!with_solution) return;
  publish_due_ = true;
  const Session& session = part_->session();
  poses_.set(part_->poses(), part_->covariances());
  frame_.enter(session.plan.frame);
  decisions_.begin_result(part_->members());
  decide(part_->verdicts().closures);
  for (const RobotId member : part_->members())
    if (const MemberPoses* published = poses_of(member, MemberStage::kSolved)) {
      roster_.keep_result(member);
      if (member != self_.robot) decide_with(*published);
    }
  frame_.set_world(session.T_frame_world ? World{session.anchor, *session.T_frame_world}
                                         : world_of(session.anchor));
  solution_anchor_ = session.anchor;
  if (session.plan.members.size() > 1) solved_ = session.plan;
  notices_.closures(part_->noise());
  part_->keep_only_results();
}

}  // namespace km
