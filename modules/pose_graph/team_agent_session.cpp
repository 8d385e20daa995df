#include <algorithm>
#include <exception>
#include <iterator>
#include <utility>

#include "modules/core/text_table.hpp"
#include "modules/pose_graph/corroboration.hpp"
#include "modules/pose_graph/frame_entry.hpp"
#include "modules/pose_graph/robust_schedule.hpp"
#include "modules/pose_graph/team_agent.hpp"
#include "modules/pose_graph/team_plan.hpp"
#include "modules/pose_graph/tree_front.hpp"

// Sessions: how they are opened, and how this robot joins and leaves them.

namespace km {
namespace {

// Status periods without progress after which a session is replaced.
constexpr double kHopelessPeriods = 15.0;

// Noise of odometry over the claimed noise that causes a notice, and its increase that causes
// another one.
constexpr double kNoisyOdometry = 2.0;
constexpr double kNoticedAgain = 1.5;

// Least number of likely closures for a chordal start from noisy odometry; a few closures would
// deform it at random. In tunnels, with five or six likely closures per robot, the team would
// decide on 2.6 % of the closures differently than one session does, instead of on less than 1 %.
// In sphere2500 with 7 times the noise, two of ten seeds have 8 and 94 times the error without the
// chordal start.
constexpr std::size_t kEnoughForChordal = 20;

// Time without new measurements after which the team is at rest [s].
constexpr double kAtRest_s = 2.0;

bool same_members(const SessionPlan& x, const SessionPlan& y) {
  return x.members.size() == y.members.size() && !has_lost_member(x, y);
}

}  // namespace

// Plans and sessions that this robot coordinates.

void TeamAgent::make_plan() {
  std::map<RobotId, TeamStatus> statuses{{self_.robot, make_status()}};
  for (const auto& [robot, peer] : peers_) {
    if (!peer.status || peer.other_method || !in_reach(peer.status->sender)) continue;
    TeamStatus& status = statuses.emplace(robot, *peer.status).first->second;
    // Poses are sent at once, but statuses only periodically.
    const auto told = told_.find(robot);
    if (told != told_.end() && told->second.frame_version > status.frame_version)
      status.frame = told->second.frame;
  }
  SessionPlan plan = plan_session(statuses, relay_.links(), self_.robot);
  if (!same_graph(plan, plan_)) plan_changed_s_ = now_s_;
  closures_known_ = closures_known(plan, statuses);
  plan_ = std::move(plan);
  std::vector<RobotId> members;
  for (const SessionMember& member : plan_.members) members.push_back(member.peer.robot);
  std::ranges::sort(members);
  ties_ = frame_ties(self_.robot, members, find_ties(statuses));
  notice_ties();
}

// Before the first solution, and while a session decides, the ties are not yet judged.
void TeamAgent::notice_ties() {
  if (in_session() || !solved_ || ties_ == noticed_) return;
  const auto changed = [](const std::vector<RobotId>& now, const std::vector<RobotId>& before) {
    std::vector<RobotId> added;
    std::ranges::set_difference(now, before, std::back_inserter(added));
    std::string names;
    for (const RobotId robot : added) names += (names.empty() ? "" : ", ") + std::to_string(robot);
    return names;
  };
  if (const auto robots = changed(ties_.tentative, noticed_.tentative); !robots.empty())
    notices_.push_back("joined tentatively with robots " + robots +
                       ": closures at a single place tie them to this robot; closures at a second "
                       "place will confirm or correct it");
  if (const auto robots = changed(ties_.untied, noticed_.untied); !robots.empty())
    notices_.push_back("no accepted closure ties robots " + robots +
                       " to this robot: they are in another frame");
  std::vector<RobotId> uncertain;
  std::ranges::set_union(ties_.tentative, ties_.untied, std::back_inserter(uncertain));
  if (const auto robots = changed(noticed_.tentative, uncertain); !robots.empty())
    notices_.push_back("robots " + robots +
                       " are no longer tentative: closures at several places tie them to this "
                       "robot");
  noticed_ = ties_;
}

void TeamAgent::coordinate() {
  if (std::exchange(plan_outdated_, false)) {
    make_plan();
    for (const auto& [robot, peer] : peers_)
      if (peer.session && in_reach(peer.session->id.coordinator)) consider(*peer.session);
  }
  if (coordinator_of(plan_) != self_.robot) return;
  if (should_open()) open_session();
  const bool due = now_s_ - session_sent_s_ >= config_.status_period_s;
  if (in_session() && part_->session().id.coordinator == self_ && due) announce();
}

void TeamAgent::announce() {
  Session& session = part_->session();
  session_sent_s_ = now_s_;
  if (!session.finished) {
    const SolverState state = part_->state();
    session.round = std::max(session.round, state.round - std::min(state.round, state.lag));
    session.cost = state.cost;
    session.gradient = state.gradient;
    part_->commit(session.round);
  }
  if (part_->members().size() > 1) relay_.say(session, now_s_);
}

bool TeamAgent::all_upright(const SessionPlan& plan) const {
  return std::all_of(plan.members.begin(), plan.members.end(), [&](const SessionMember& member) {
    return member.peer == self_ ? graph_.upright() : peers_.at(member.peer.robot).status->upright;
  });
}

// Bytes of the member that has sent most in the last session, because the budget applies to every
// robot.
std::uint64_t TeamAgent::price_bytes() const {
  std::uint64_t most = sent_bytes_;
  for (const RobotId member : part_->members())
    if (const MemberPoses* told = part_->told_by(told_, member, 1))
      most = std::max(most, told->sent_bytes);
  return most;
}

bool TeamAgent::paid_for() const {
  const double price_s = static_cast<double>(price_bytes()) / (1e3 * config_.exchange_budget_kb_s);
  return now_s_ - part_->moved_s() >= std::min(price_s, config_.session_wait_s);
}

bool TeamAgent::worthwhile() const {
  const bool alone = plan_.members.size() == 1;
  if (alone || !same_members(part_->session().plan, plan_)) return true;
  // The first closures connect the maps; each further closure changes them less. Odometry alone
  // changes nothing, so new odometry can wait until the team is at rest.
  const auto used = static_cast<double>(closures_used_);
  const bool grown = closures_known_ != closures_used_ &&
                     static_cast<double>(closures_known_) >= (1.0 + config_.session_growth) * used;
  return grown || now_s_ - plan_changed_s_ >= kAtRest_s ||
         now_s_ - part_->moved_s() >= config_.session_wait_s;
}

// True if a member has been in another session since the last one.
bool TeamAgent::has_moved_on() const {
  const auto elsewhere = [&](RobotId robot) {
    return robot != self_.robot && part_->told_by(told_, robot, 0) == nullptr;
  };
  return std::any_of(part_->members().begin(), part_->members().end(), elsewhere);
}

bool TeamAgent::should_open() const {
  if (!part_) return true;
  const Session& session = part_->session();
  const bool hopeless = now_s_ - part_->moved_s() > kHopelessPeriods * config_.status_period_s;
  const bool stalled = !over_ && (deserted_ || hopeless);
  if (same_graph(session.plan, plan_)) return session.finished ? has_moved_on() : over_ || stalled;
  if (session.id.coordinator != self_ || has_lost_member(session.plan, plan_)) return true;
  return over_ ? !session.finished || (paid_for() && worthwhile()) : stalled;
}

void TeamAgent::open_session() {
  Session session{.id = {self_, ++sessions_opened_}, .plan = plan_};
  session.method = config_.method;
  session.upright = all_upright(plan_);
  session.max_rounds = static_cast<std::uint32_t>(config_.max_rounds);
  session.anchor = coordinator_of(plan_);
  // `world` keeps its place when its robot is no longer a member.
  if (world_ && world_->anchor < session.anchor && frame_ == plan_.frame) {
    session.anchor = world_->anchor;
    session.T_frame_world = world_->T_frame_world;
  }
  if (!join(session)) return;
  closures_used_ = closures_known_;
  announce();
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
  if (session.id.number <= peers_.at(session.id.coordinator.robot).joined) return false;
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
    if (part_->follow(session) && !solved_) leave(part_->stage() == 1U && !has_failed());
    return;
  }
  const auto& members = session.plan.members;
  const bool member = std::any_of(members.begin(), members.end(),
                                  [&](const SessionMember& m) { return m.peer == self_; });
  const bool from_own_coordinator = part_ && !over_ &&
                                    session.id.coordinator == part_->session().id.coordinator &&
                                    part_->session().id.number < session.id.number;
  // The other members continue without this robot.
  if (from_own_coordinator && !member) return leave(part_->all_solved(told_));
  // This robot joins only if it knows a connection to the coordinator, and if all members are
  // present.
  if (!member || session.finished || !accepts(session) || misses_member(session.plan) ||
      !plan_.has_member(session.id.coordinator.robot) || join(session))
    return;
  // consider() runs again with every new message, but counts the refusal only once.
  const RobotId coordinator = session.id.coordinator.robot;
  if (std::exchange(peers_.at(coordinator).missed, session.id.number) != session.id.number)
    refuse("a session of robot " + std::to_string(coordinator) +
           " over closures that are not at hand");
}

// The session that this robot is in.

void TeamAgent::extend_poses() {
  if (poses_.empty()) poses_.push_back(graph_.T_odom_first());
  while (poses_.size() < graph_.keyframes())
    poses_.push_back(poses_.back() * graph_.step_to(static_cast<std::uint32_t>(poses_.size())));
}

std::optional<FrozenPart> TeamAgent::freeze(const Session& session) const {
  const SessionPlan& plan = session.plan;
  FrozenPart part;
  SessionGraph& graph = part.graph;
  graph.self = self_.robot;
  for (const SessionPair& pair : plan.pairs) {
    if (pair.a != self_.robot && pair.b != self_.robot) continue;
    const auto* edges = graph_.edges(pair.a == self_.robot ? pair.b : pair.a, pair.edges);
    if (edges == nullptr) return std::nullopt;
    graph.between.insert(graph.between.end(), edges->begin(), edges->end());
  }
  std::set<KeyframeIndex> ends{0};
  for (const auto& [robot, peer] : peers_) {
    const auto* edges = graph_.newest_edges(robot);
    if (edges == nullptr) continue;
    for (const PoseEdge& e : *edges) ends.insert(e.end_on(self_.robot).index);
    const auto told = told_.find(robot);
    if (plan.has_member(robot) || told == told_.end() || told->second.frame != plan.frame) continue;
    const MemberPoses& poses = told->second;
    for (std::size_t k = 0; k < poses.keyframes.size(); ++k)
      graph.told[{robot, poses.keyframes[k]}] = poses.T_frame_kf[k].pose();
    for (const PoseEdge& e : *edges)
      if (graph.told.contains(e.other(self_.robot))) graph.to_absent.push_back(e);
  }
  for (const PoseEdge& e : graph.between) ends.insert(e.end_on(self_.robot).index);
  part.public_keyframes.assign(ends.begin(), ends.end());
  std::sort(graph.between.begin(), graph.between.end(),
            [](const PoseEdge& a, const PoseEdge& b) { return a.id() < b.id(); });
  graph.own = graph_.own_edges();
  graph.odometry = graph_.keyframes() - 1;
  graph.step_precision[self_.robot] = graph_.mean_step_precision();
  graph.upright = session.upright;
  if (session.upright) graph.verticals = graph_.verticals();
  part.place = *place_in(plan, self_.robot);
  part.in_frame = frame_ == plan.frame || plan.members.front().peer == self_;
  part.suspicious = config_.robust && config_.method == PgoMethod::kNewton;
  return part;
}

// Returns the closures inside this robot that are likely true before anything is solved. If
// odometry is noisy, these are the closures that its noise explains. Otherwise, these are the
// closures that agree with a closure a few keyframes away.
std::vector<PoseEdge> TeamAgent::likely_closures(std::span<const PoseEdge> inside) const {
  const std::vector<PoseEdge>& explained = graph_.odometry_noise().likely;
  if (!explained.empty()) return explained;
  const std::map<RobotId, Precision> step{{self_.robot, graph_.mean_step_precision()}};
  const Corroboration::PoseOf pose = [&](const KeyframeId& id) { return poses_[id.index]; };
  const std::vector<bool> isolated =
      Corroboration(inside, pose, step, 3).isolated(default_threshold(3));
  std::vector<PoseEdge> likely;
  for (std::size_t k = 0; k < inside.size(); ++k)
    if (!isolated[k]) likely.push_back(inside[k]);
  return likely;
}

// A robot alone may start at the chordal initialisation. If closures may be false, it does so only
// if the truncated cost of all its closures is lower there.
void TeamAgent::try_chordal(const Session& session) {
  const std::vector<PoseEdge>* inside = graph_.newest_edges(self_.robot);
  if (session.plan.members.size() > 1 || inside == nullptr || inside->size() == chordal_tried_)
    return;
  chordal_tried_ = inside->size();
  const std::vector<PoseEdge> all = graph_.own_edges();
  const std::size_t steps = graph_.keyframes() - 1;
  if (!config_.robust || config_.method != PgoMethod::kNewton) {
    poses_ = better_of_chordal(std::move(poses_), all);
    return;
  }
  std::vector<PoseEdge> likely(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(steps));
  for (const PoseEdge& closure : likely_closures(*inside)) likely.push_back(closure);
  if (likely.size() < steps + kEnoughForChordal) return;
  std::vector<SE3> chordal = better_of_chordal(poses_, likely);
  const auto cost = [&](const std::vector<SE3>& poses) {
    const double barc = default_threshold(3);
    double sum = 0.0;
    for (std::size_t k = 0; k < all.size(); ++k) {
      const double r = residual_of(all[k], poses[all[k].from.index], poses[all[k].to.index]);
      sum += k < steps ? r * r : std::min(r * r, barc * barc);
    }
    return sum;
  };
  if (cost(chordal) < cost(poses_)) poses_ = std::move(chordal);
}

void TeamAgent::judge_odometry() {
  graph_.judge_odometry();
  const OdometryNoise& noise = graph_.odometry_noise();
  const double worst = std::max(noise.rotation, noise.translation);
  if (worst < kNoisyOdometry || worst < kNoticedAgain * odometry_noticed_) return;
  odometry_noticed_ = worst;
  notices_.push_back("odometry is " + fixed(noise.rotation, 1) + " times noisier in rotation and " +
                     fixed(noise.translation, 1) + " times in translation than it claims, by " +
                     std::to_string(noise.places) +
                     " places of loop closures inside this robot; it is weighed accordingly");
}

void TeamAgent::notice_closure_noise() {
  for (const auto& [peer, cycles] : noise_.pairs) {
    double& noticed = closures_noticed_.try_emplace(peer, 1.0).first->second;
    if (cycles.factor < kNoticedAgain * noticed) continue;
    noticed = cycles.factor;
    notices_.push_back((peer == self_.robot ? "closures inside this robot"
                                            : "closures with robot " + std::to_string(peer)) +
                       " are " + fixed(cycles.factor, 1) +
                       " times noisier than closures of the team usually are, by " +
                       fixed(cycles.places, 0) + " places; they are weighed accordingly");
  }
}

bool TeamAgent::join(const Session& session) {
  if (graph_.keyframes() == 0) return false;
  if (config_.robust) judge_odometry();
  auto part = freeze(session);
  if (!part) return false;
  if (in_session()) leave(part_->all_solved(told_));
  if (session.plan.members.size() > 1) decide_anew();
  if (part_) {
    rounds_before_ += part_->state().round;
    optimising_s_ += part_->moved_s() - started_s_;
  }
  extend_poses();
  if (part->graph.to_absent.empty()) try_chordal(session);
  part->graph.start = poses_;
  part->graph.decided = decided_;
  part->graph.noise = noise_;
  part_.emplace(session, self_, std::move(*part), factory_,
                AlignmentTolerance{config_.alignment_rotation_rad, config_.alignment_translation_m},
                config_.status_period_s, now_s_);
  if (const auto peer = peers_.find(session.id.coordinator.robot); peer != peers_.end())
    peer->second.joined = session.id.number;
  over_ = solved_ = deserted_ = false;
  started_s_ = now_s_;
  sent_bytes_ = 0;
  verdicts_.clear();
  reconsider_due_ = false;
  return true;
}

bool TeamAgent::misses_member(const SessionPlan& plan) const {
  return std::any_of(plan.members.begin(), plan.members.end(),
                     [&](const SessionMember& member) { return !in_reach(member.peer); });
}

bool TeamAgent::has_failed() const {
  const auto failed = [&](RobotId robot) {
    return robot == self_.robot ? part_->stage() == 2U : part_->told_by(told_, robot, 2) != nullptr;
  };
  return std::any_of(part_->members().begin(), part_->members().end(), failed);
}

void TeamAgent::advance(TeamOutput& output) {
  if (!in_session()) return;
  const auto stage = part_->stage();
  for (SessionLetter& letter : part_->advance(told_, now_s_)) relay_.say(std::move(letter), now_s_);
  for (const RobotId sender : part_->take_refused())
    refuse("a letter of robot " + std::to_string(sender) + " that is of no use");
  output.more |= part_->worked();
  publish_due_ |= part_->worked() && part_->stage() == 0U;
  if (part_->stage() != stage) enter_stage(output);
  if (in_session()) conclude();
}

void TeamAgent::enter_stage(TeamOutput& output) {
  const Session& session = part_->session();
  output.more = true;
  if (part_->stage() == 0U) {
    if (frame_ != session.plan.frame) {
      ++frame_version_;
      world_.reset();
    }
    frame_ = session.plan.frame;
    plan_outdated_ = true;
  }
  if (part_->stage() == 2U)
    notices_.push_back("session " + std::to_string(session.id.number) + " of robot " +
                       std::to_string(session.id.coordinator.robot) +
                       " cannot be solved: " + part_->failure());
  hand_out(output);  // sent_bytes_ of the poses includes these
  tell_poses();
}

void TeamAgent::tell_poses() {
  MemberPoses message{.sender = self_, .session = part_->session().id};
  message.stage = *part_->stage();
  message.frame = frame_;
  message.frame_version = frame_version_;
  message.step_precision = graph_.mean_step_precision();
  message.keyframes = part_->public_keyframes();
  const std::vector<SE3>& poses = part_->poses();
  for (const KeyframeIndex keyframe : message.keyframes)
    message.T_frame_kf.push_back(SinglePose::of(poses[keyframe]));
  for (const WeighedClosure& verdict : part_->verdicts().closures)
    if (verdict.id.from.robot != verdict.id.to.robot) message.verdicts.push_back(verdict);
  message.sent_bytes = sent_bytes_;
  told_[self_.robot] = message;
  const bool concerns_others = part_->members().size() > 1 || message.keyframes.size() > 1;
  if (concerns_others) relay_.say(std::move(message), now_s_);
}

void TeamAgent::decide(const std::vector<WeighedClosure>& verdicts) {
  if (verdicts.empty()) return;
  const bool for_good = part_->members().size() > 1 && !part_->state().held;
  for (const auto& [id, kept] : verdicts) {
    const auto before = decided_.find(id);
    const bool is_new = before == decided_.end() || before->second != kept;
    if (is_new && !for_good) provisional_.insert(id);
    decided_[id] = verdicts_[id] = kept;
  }
  counted_.clear();
  plan_outdated_ = true;
  verdicts_due_.emplace();
  for (const auto& [id, kept] : verdicts_) verdicts_due_->closures.push_back({id, kept});
}

void TeamAgent::decide_anew() {
  for (const ClosureId& id : std::exchange(provisional_, {})) decided_.erase(id);
  counted_.clear();
  noise_ = team_noise_;
}

// The verdicts of a member on a closure are valid for both of its robots.
void TeamAgent::decide_with(const MemberPoses& poses) {
  if (poses.session != part_->session().id || poses.stage != 1) return;
  std::vector<WeighedClosure> of_both;
  for (const WeighedClosure& verdict : poses.verdicts)
    if (std::minmax(verdict.id.from.robot, verdict.id.to.robot) ==
            std::minmax(self_.robot, poses.sender.robot) &&
        part_->joins_members(verdict.id))
      of_both.push_back(verdict);
  decide(of_both);
}

// Deferred closures have not been weighed; a deferred closure that fits the solution may be true.
// For a closure between robots, both robots use the poses that both have sent, and so decide
// equally.
void TeamAgent::reconsider() {
  if (!reconsider_due_ || !part_->all_solved(told_)) return;
  reconsider_due_ = false;
  std::vector<PoseEdge> closures;
  for (const RobotId member : part_->members())
    if (const auto* edges = graph_.newest_edges(member))
      closures.insert(closures.end(), edges->begin(), edges->end());
  bool any = false;
  for (const PoseEdge& e : closures) {
    const auto decided = decided_.find(e.id());
    if (decided == decided_.end() || decided->second || !fits(e)) continue;
    if (++chances_[e.id()] > kChances) continue;
    decided_.erase(decided);
    any = true;
  }
  if (!any) return;
  ++reconsidered_;
  counted_.clear();
  plan_outdated_ = true;
}

bool TeamAgent::fits(const PoseEdge& closure) const {
  const bool inside = closure.from.robot == closure.to.robot;
  const auto pose = [&](const KeyframeId& id) -> std::optional<SE3> {
    if (inside) return id.index < poses_.size() ? std::optional(poses_[id.index]) : std::nullopt;
    const MemberPoses& told = told_.at(id.robot);
    const auto at = std::lower_bound(told.keyframes.begin(), told.keyframes.end(), id.index);
    if (at == told.keyframes.end() || *at != id.index) return std::nullopt;
    return told.T_frame_kf[static_cast<std::size_t>(at - told.keyframes.begin())].pose();
  };
  const auto from = pose(closure.from), to = pose(closure.to);
  return from && to && residual_of(closure, *from, *to) <= kSecondChance * part_->state().barc;
}

// Ends the session or sets `world`, if the poses received from the members allow it.
void TeamAgent::conclude() {
  Session& session = part_->session();
  const RobotId anchor = session.anchor;
  if (part_->stage() == 0U && (!world_ || world_->anchor != anchor)) {
    const bool told = anchor == self_.robot || part_->told_by(told_, anchor, 0) != nullptr;
    const auto world = session.T_frame_world ? session.T_frame_world
                       : told                ? world_of(anchor)
                                             : std::nullopt;
    if (world) world_ = World{anchor, *world};
  }
  const bool coordinates = session.id.coordinator == self_;
  if (part_->all_solved(told_) && coordinates) {
    const SolverState state = part_->state();
    session.round = state.round;
    session.cost = state.cost;
    session.gradient = state.gradient;
    session.finished = true;
    if (const auto world = world_of(session.anchor)) session.T_frame_world = world;
    announce();
    leave(true);
  } else if (has_failed()) {
    session.finished = coordinates;
    if (coordinates) announce();
    leave(false);
  } else if (misses_member(session.plan)) {
    leave(part_->all_solved(told_));
  }
}

void TeamAgent::leave(bool with_solution) {
  if (part_->stage()) poses_ = with_solution ? part_->poses() : part_->committed_poses();
  over_ = true;
  solved_ = with_solution;
  const Session& session = part_->session();
  if (with_solution && session.finished && session.T_frame_world)
    world_ = World{session.anchor, *session.T_frame_world};
  publish_due_ = true;
  plan_outdated_ = true;
  if (!with_solution) return;
  decide(part_->verdicts().closures);
  for (const RobotId member : part_->members())
    if (const MemberPoses* told = part_->told_by(told_, member, 1); told && member != self_.robot)
      decide_with(*told);
  noise_ = part_->noise();
  notice_closure_noise();
  if (part_->members().size() > 1) team_noise_ = noise_;
  reconsider_due_ = part_->state().set_aside;
}

}  // namespace km
