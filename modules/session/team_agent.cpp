#include "modules/session/team_agent.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "modules/robust/closure_places.hpp"
#include "modules/session/team_plan.hpp"

// Other robots, their messages and the messages of this robot. The sessions are in
// team_agent_session.cpp.

namespace km {

TeamAgent::TeamAgent(const PoseGraphConfig& config, TeamPeer self, MemberSolverFactory factory,
                     int dimension)
    : config_(checked(config)),
      self_(self),
      factory_(std::move(factory)),
      graph_(self.robot, dimension),
      roster_(self, config_.method),
      notices_(self.robot),
      schedule_(config_),
      frame_(self),
      refinement_(config_.refinement_period_s) {
  roster_.connect(links_.links);
}

bool TeamAgent::add(const KeyframeOdometry& keyframe) {
  const bool taken = graph_.add(keyframe);
  plan_outdated_ |= taken;
  return taken || refuse("a keyframe that is not the next one of this robot");
}

bool TeamAgent::add(const Closure& closure) {
  const ClosureId id = closure.id();
  const bool taken = graph_.add(closure);
  plan_outdated_ |= taken;
  if (!taken && touches(id, self_.robot) &&
      (id.from == id.to || !pose_edge(closure.relative_pose())))
    return refuse("a closure that has no usable pose or covariance");
  if (!taken && touches(id, self_.robot) && graph_.is_full(id))
    return refuse("closures of robots " + std::to_string(id.from.robot) + " and " +
                  std::to_string(id.to.robot) + " beyond the " +
                  std::to_string(OwnGraph::kMaxClosures) + " that are kept");
  return taken;
}

bool TeamAgent::add(const InlierSet& set) {
  const bool taken = graph_.add(set);
  plan_outdated_ |= taken;
  const auto between = [&](const ClosureId& id) {
    return std::minmax(id.from.robot, id.to.robot) == std::minmax(set.a, set.b);
  };
  const bool concerns = set.a == self_.robot || set.b == self_.robot;
  if (!taken && concerns &&
      (set.a > set.b || !std::all_of(set.closures.begin(), set.closures.end(), between)))
    return refuse("an inlier set with closures of other robots than it is about");
  return taken;
}

bool TeamAgent::add(const PositionFix& fix) {
  const bool taken = graph_.add(fix);
  plan_outdated_ |= taken;
  return taken || refuse("a fix that is not usable, or not after the last one");
}

void TeamAgent::restore(const TeamSolution& solution) {
  const Trajectory& own = solution.trajectory;
  awaited_keyframes_ = std::max<std::size_t>(own.T_world_kf.size(), 1);
  poses_.restore(own.T_world_kf);
  frame_.set_world(World{own.anchor, SE3::Identity()});
  published_anchor_ = own.anchor;
  decisions_.decide(solution.verdicts.closures);
  for (const TeamPeer& peer : solution.peers) {
    meet(peer);
    MemberPoses held{.sender = peer, .stage = MemberStage::kSolved, .frame = frame_.frame()};
    for (const auto& [id, T_world_kf] : own.public_poses) {
      if (id.robot != peer.robot) continue;
      held.keyframes.push_back(id.index);
      held.T_frame_kf.push_back(SinglePose::of(T_world_kf));
    }
    if (held.keyframes.empty()) continue;
    roster_.take(held);
    roster_.keep_result(peer.robot);
  }
}

void TeamAgent::peer_alive(TeamPeer peer) {
  if (peer.robot == self_.robot) return;
  meet(peer);
  direct_[peer.robot] = peer.boot;
  if (!in_session()) return;
  // Messages to the members beyond the lost link may be lost, too.
  for (const RobotId member : part_->members())
    if (member == peer.robot || !direct_.contains(member)) part_->reachable_again(member);
}

void TeamAgent::update_links(const LinksReport& links) {
  if (links.version <= links_.version) return;
  links_ = links;
  roster_.connect(links_.links);
  plan_outdated_ = true;
}

void TeamAgent::meet(const TeamPeer& peer) {
  switch (roster_.meet(peer)) {
    case TeamRoster::Meeting::kKnown:
    case TeamRoster::Meeting::kNew:
      return;
    case TeamRoster::Meeting::kOtherIncarnation:
      forget_measured(peer.robot);
      break;
    case TeamRoster::Meeting::kOtherProcess:
      break;
  }
  plan_outdated_ = true;
}

void TeamAgent::peer_restarted(const TeamPeer& peer) {
  meet(peer);
  forget_measured(peer.robot);
}

void TeamAgent::forget_measured(RobotId robot) {
  graph_.forget(robot);
  decisions_.discard(robot);
  plan_outdated_ = true;
}

bool TeamAgent::receive(const TeamMessage& message) {
  const TeamPeer sender = origin_of(message);
  const auto direct = direct_.find(sender.robot);
  if (sender.robot == self_.robot || (direct != direct_.end() && direct->second != sender.boot))
    return refuse("a message of robot " + std::to_string(sender.robot) +
                  " by another process than the one that is known");
  return std::visit([&](const auto& m) { return take(sender, m); }, message);
}

bool TeamAgent::take(const TeamPeer& sender, const TeamStatus& status) {
  meet(sender);
  if (!is_well_formed(status))
    return refuse("a status of robot " + std::to_string(sender.robot) + " that is not in order");
  plan_outdated_ = true;
  roster_.take(status);
  return !roster_.at(sender.robot).other_method ||
         refuse("robot " + std::to_string(sender.robot) + " is configured for another method");
}

bool TeamAgent::take(const TeamPeer& sender, const Session& session) {
  meet(sender);
  if (!well_formed(session))
    return refuse("a session of robot " + std::to_string(sender.robot) + " that is not in order");
  roster_.take(session);
  consider(session);
  return true;
}

bool TeamAgent::take(const TeamPeer& sender, const MemberPoses& poses) {
  meet(sender);
  if (!is_well_formed(poses))
    return refuse("poses of robot " + std::to_string(sender.robot) + " that are not in order");
  plan_outdated_ = true;
  const auto is_member = [&] {
    return part_ && poses_of(sender.robot, MemberStage::kEntered) != nullptr;
  };
  const bool was_member = is_member();
  roster_.take(poses);
  const bool of_session = in_session() && poses.session == part_->session().id;
  if (poses.stage == MemberStage::kSolved && !of_session) roster_.keep_result(sender.robot);
  if (was_member && poses.session != part_->session().id && state_ == SessionState::kRunning)
    state_ = SessionState::kDeserted;
  if (!is_member()) return true;
  if (in_session()) part_->note_activity(now_s_);
  if (state_ == SessionState::kSolved) decide_with(poses);
  return true;
}

bool TeamAgent::take(const TeamPeer& sender, const ReliableMessage& message) {
  if (!in_session() || message.session != part_->session().id) return true;  // too early or late
  return part_->receive(message, now_s_) ||
         refuse("a message of robot " + std::to_string(sender.robot) + " that is of no use");
}

TeamOutput TeamAgent::step(double now_s, std::uint64_t sent_bytes) {
  now_s_ = now_s;
  if (part_) part_->count_sent(sent_bytes - sent_bytes_);
  sent_bytes_ = sent_bytes;
  TeamOutput output;
  const bool is_complete = graph_.keyframes() >= awaited_keyframes_;
  if (is_complete) {
    coordinate(output);
    advance(output);
    refine_alone();
  }
  send_status(output);
  if (is_complete) publish(output);
  output.verdicts = decisions_.take_verdicts();
  output.notices = notices_.take();
  return output;
}

TeamStatus TeamAgent::make_status() {
  std::vector<EdgeSetOffer> offers = graph_.offers();
  for (EdgeSetOffer& offer : offers)
    decisions_.count_places(offer, *graph_.edges(offer.peer, offer.id),
                            graph_.alignments(offer.peer));
  return {.sender = self_,
          .keyframes = graph_.keyframes(),
          .revision = graph_.revision(),
          .offers = std::move(offers),
          .method = config_.method,
          .T_odom_first = graph_.T_odom_first(),
          .upright = graph_.upright(),
          .datum = datum_of(self_.robot)};
}

void TeamAgent::send_status(TeamOutput& output) {
  if (!status_schedule_.may_be_due(now_s_)) return;
  TeamStatus status = make_status();
  const StatusSchedule::Due due = status_schedule_.due(status, now_s_);
  if (due == StatusSchedule::Due::kNo) return;
  output.progress = make_progress();
  if (due == StatusSchedule::Due::kStatus) output.messages.emplace_back(std::move(status));
}

std::optional<World> TeamAgent::world_of(RobotId anchor) const {
  return frame_.world_of(anchor, roster_, graph_.T_odom_first(), part_ && part_->session().upright);
}

// Identity of the datum of which keyframe 0 is the origin, located or not; 0: there is none.
std::uint64_t TeamAgent::own_datum() const {
  return graph_.fixes().empty() ? map_id_ : graph_.fixes().back().datum;
}

// Identity of the datum in which a robot is located; 0: it is not located.
std::uint64_t TeamAgent::datum_of(RobotId robot) const {
  if (robot == self_.robot) {
    const std::uint64_t own = own_datum();
    const bool located =
        own != 0 && (graph_.fixes().empty() ? is_tied_to_earlier_runs() : placement_.state.located);
    return located ? own : 0;
  }
  const TeamRoster::Peer* peer = roster_.find(robot);
  return peer != nullptr && peer->status ? peer->status->datum : 0;
}

// This robot if it is located in a datum. Otherwise the lowest robot with this property that
// closures tie to it.
std::optional<RobotId> TeamAgent::robot_in_datum() const {
  if (datum_of(self_.robot) != 0) return self_.robot;
  std::optional<RobotId> lowest;
  for (const SessionMember& member : plan_.members) {
    const RobotId robot = member.peer.robot;
    if (datum_of(robot) != 0 && !std::ranges::binary_search(ties_.not_joined, robot))
      lowest = std::min(lowest.value_or(robot), robot);
  }
  return lowest;
}

// The frame of the datum. Its name is the lowest known robot in the datum, tied to this robot or
// not.
std::optional<World> TeamAgent::world_of_datum() const {
  const auto located = robot_in_datum();
  auto world = located ? world_of(*located) : std::nullopt;
  if (!world) return std::nullopt;
  const std::uint64_t datum = datum_of(*located);
  for (const auto& [robot, peer] : roster_.peers())
    if (datum_of(robot) == datum) world->anchor = std::min(world->anchor, robot);
  return world;
}

// The frame in which this robot publishes. If no closure ties it to the anchor of the session, this
// is the frame of the lowest robot that closures tie to it.
std::optional<World> TeamAgent::tied_world() const {
  const std::optional<World>& world = frame_.world();
  if (auto of_datum = world ? world_of_datum() : std::nullopt) return of_datum;
  if (!world || !std::ranges::binary_search(ties_.not_joined, world->anchor)) return world;
  return world_of(lowest_tied(self_.robot, plan_, ties_));
}

bool TeamAgent::is_located() const {
  return robot_in_datum() || is_tied_to_earlier_runs();
}

// True if kept closures at two places tie the last run to keyframes before it, or if there is only
// one run.
bool TeamAgent::is_tied_to_earlier_runs() const {
  if (graph_.later_runs().empty()) return true;
  constexpr std::size_t kLeastPlaces = 2;  // one place may be mistaken for another
  std::vector<PoseEdge> across =
      graph_.closures_across(graph_.later_runs().back(), graph_.keyframes());
  std::erase_if(across, [this](const PoseEdge& e) {
    const auto decided = decisions_.decided().find(e.id());
    return decided == decisions_.decided().end() || !decided->second;
  });
  // Places of the present run: a short run before it may have a single place.
  for (PoseEdge& e : across) (e.from.index < e.to.index ? e.from : e.to).index = 0;
  return find_places(across).sizes.size() >= kLeastPlaces;
}

std::optional<FixesState> TeamAgent::fixes_state() const {
  if (graph_.fixes().empty()) return std::nullopt;
  FixesState state = placement_.state;
  double sum = 0.0;
  for (std::size_t k = 0; k < placement_.kept.size(); ++k) {
    const PositionFix& fix = graph_.fixes()[k];
    if (placement_.kept[k])
      sum += (poses()[fix.keyframe.index] * fix.p_kf - poses().front() * fix.p_datum).squaredNorm();
  }
  if (state.used > 0) state.residual_m = std::sqrt(sum / state.used);
  return state;
}

void TeamAgent::publish(TeamOutput& output) {
  const auto world = frame_.world() ? tied_world() : std::nullopt;
  if (!world || (!publish_due_ && published_anchor_ == world->anchor)) return;
  publish_due_ = false;
  published_anchor_ = world->anchor;
  output.progress = make_progress();
  if (!output.progress->located) return;
  Trajectory trajectory{self_.robot, world->anchor, {}};
  const SE3 T_world_frame = world->T_frame_world.inverse();
  for (const SE3& T_frame_kf : poses()) trajectory.T_world_kf.push_back(T_world_frame * T_frame_kf);
  if (solution_anchor_ == world->anchor) trajectory.covariances = poses_.covariances();
  trajectory.scale_sigma = robot_in_datum() ? 0.0 : config_.scale_sigma;
  trajectory.public_poses = held_poses(T_world_frame);
  output.trajectory = std::move(trajectory);
}

// Public poses of the other robots in the frame of this one.
std::map<KeyframeId, SE3> TeamAgent::held_poses(const SE3& T_world_frame) const {
  std::map<KeyframeId, SE3> held;
  for (const auto& [robot, poses] : roster_.results())
    for (std::size_t k = 0; k < poses.keyframes.size(); ++k)
      if (robot != self_.robot && poses.frame == frame_.frame())
        held[{robot, poses.keyframes[k]}] = T_world_frame * poses.T_frame_kf[k].pose();
  return held;
}

// That of the last session until the present one has evaluated its own.
TeamAgent::Objective TeamAgent::objective() const {
  if (!part_) return objective_before_;
  const Session& session = part_->session();
  if (session.finished) return {session.cost, session.gradient};
  const auto& state = part_->state();
  return state.cost > 0.0 ? Objective{state.cost, state.gradient} : objective_before_;
}

OptimizerProgress TeamAgent::make_progress() const {
  const auto world = tied_world();
  OptimizerProgress progress{.anchor = world ? world->anchor : self_.robot,
                             .members = {self_.robot}};
  progress.located = is_located();
  progress.odometry_rotation_noise = graph_.odometry_noise().rotation;
  progress.odometry_translation_noise = graph_.odometry_noise().translation;
  progress.fixes = fixes_state();
  progress.odometry_breaks = static_cast<std::uint32_t>(graph_.odometry_breaks().size());
  progress.round = rounds_before_;
  const Objective objective = this->objective();
  progress.cost = objective.cost;
  progress.gradient_norm = objective.gradient;
  progress.seconds = optimising_s_;
  if (!part_) return progress;
  const Session& session = part_->session();
  if (in_session() || state_ == SessionState::kSolved) {
    progress.members = part_->members();
    progress.tentative = ties_.tentative;
    progress.not_joined = ties_.not_joined;
  }
  progress.round += part_->state().round;
  progress.odometry_rotation_noise *= part_->state().odometry_noise;
  progress.odometry_translation_noise *= part_->state().odometry_noise;
  progress.seconds += part_->last_activity_s() - part_->started_s();
  progress.settled = !in_session() && session.finished && !publish_due_ && holds_all(session.plan);
  return progress;
}

bool TeamAgent::holds_all(const SessionPlan& plan) const {
  const auto self = std::find_if(plan.members.begin(), plan.members.end(),
                                 [&](const SessionMember& member) { return member.peer == self_; });
  if (self->revision != graph_.revision() || self->datum != datum_of(self_.robot)) return false;
  std::optional<RobotId> last;
  for (const EdgeSetOffer& offer : graph_.offers()) {
    const bool newest = offer.peer != last;
    last = offer.peer;
    const TeamRoster::Peer* peer = roster_.find(offer.peer);
    if (!newest || peer == nullptr || peer->other_method ||
        !roster_.in_reach({offer.peer, peer->boot}))
      continue;
    const SessionPair pair{std::min(self_.robot, offer.peer), std::max(self_.robot, offer.peer),
                           offer.id};
    if (std::find(plan.pairs.begin(), plan.pairs.end(), pair) == plan.pairs.end()) return false;
  }
  return true;
}

}  // namespace km
