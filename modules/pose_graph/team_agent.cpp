#include "modules/pose_graph/team_agent.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>
#include <utility>

#include "modules/pose_graph/team_message_bytes.hpp"
#include "modules/pose_graph/team_plan.hpp"
#include "modules/pose_graph/vertical_prior.hpp"

// Other robots, their messages and the messages of this robot. The sessions are in
// team_agent_session.cpp.

namespace km {
namespace {

// Earliest time of a changed status, and of one with changed links [periods].
constexpr double kEarlyStatus = 0.5;
constexpr double kEarlyLinks = 0.05;

bool same_content(const TeamStatus& a, const TeamStatus& b) {
  const auto rest = [](const TeamStatus& s) {
    return std::tie(s.sender, s.receives, s.frame, s.frame_version, s.keyframes, s.revision,
                    s.offers, s.method, s.upright);
  };
  return rest(a) == rest(b) && a.T_odom_first.matrix() == b.T_odom_first.matrix();
}

// Checks everything that this robot relies on, including the checks of the codec, because no other
// robot is trusted.
bool in_order(const MemberPoses& poses) {
  const auto& keyframes = poses.keyframes;
  const auto finite = [](const SinglePose& T) {
    constexpr float kUnit = 1e-3F;
    return std::abs(T.q.norm() - 1.0F) < kUnit && T.t.allFinite();
  };
  const Precision& step = poses.step_precision;
  return !keyframes.empty() && keyframes.front() == 0 &&
         std::adjacent_find(keyframes.begin(), keyframes.end(), std::greater_equal<>()) ==
             keyframes.end() &&
         poses.T_frame_kf.size() == keyframes.size() &&
         std::all_of(poses.T_frame_kf.begin(), poses.T_frame_kf.end(), finite) &&
         step.kappa > 0.0 && step.tau > 0.0 && std::isfinite(step.kappa + step.tau);
}

bool in_order(const TeamStatus& status) {
  const auto by_peer = [](const EdgeSetOffer& a, const EdgeSetOffer& b) { return a.peer < b.peer; };
  return std::is_sorted(status.offers.begin(), status.offers.end(), by_peer) &&
         status.T_odom_first.matrix().allFinite();
}

}  // namespace

TeamAgent::TeamAgent(const PoseGraphConfig& config, TeamPeer self, MemberSolverFactory factory)
    : config_(checked(config)),
      self_(self),
      factory_(std::move(factory)),
      graph_(self.robot),
      relay_(self, config_.status_period_s),
      component_{self.robot},
      schedule_(config_),
      frame_(self),
      notices_(self.robot) {}

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

void TeamAgent::peer_alive(TeamPeer peer) {
  if (peer.robot == self_.robot) return;
  meet(peer);
  relay_.link_up(peer, now_s_);
  if (!in_session()) return;
  for (const RobotId member : part_->members())
    if (relay_.next_hop(member) == peer.robot) part_->reachable_again(member);
}

void TeamAgent::peer_lost(RobotId robot) {
  relay_.link_down(robot, now_s_);
}

TeamAgent::Peer& TeamAgent::meet(const TeamPeer& peer) {
  Peer& entry = peers_.try_emplace(peer.robot, Peer{.boot = peer.boot}).first->second;
  if (entry.boot != peer.boot) {
    if (!is_same_incarnation(entry.boot, peer.boot)) forget_measured(peer.robot);
    public_poses_.erase(peer.robot);
    plan_outdated_ = true;
    entry = Peer{.boot = peer.boot};
  }
  return entry;
}

void TeamAgent::peer_restarted(const TeamPeer& peer) {
  meet(peer);
  forget_measured(peer.robot);
}

void TeamAgent::forget_measured(RobotId robot) {
  graph_.forget(robot);
  decisions_.forget(robot);
  plan_outdated_ = true;
}

void TeamAgent::watch_links() {
  relay_.step(now_s_);
  if (links_seen_ == relay_.links_version()) return;
  links_seen_ = relay_.links_version();
  component_ = relay_.links().component(self_.robot);
  plan_outdated_ = true;
}

bool TeamAgent::in_reach(const TeamPeer& peer) const {
  if (peer == self_) return true;
  const auto known = peers_.find(peer.robot);
  return known != peers_.end() && known->second.boot == peer.boot &&
         component_.contains(peer.robot);
}

bool TeamAgent::receive(RobotId from, const TeamMessagePtr& message) {
  const TeamPeer sender = origin_of(*message);
  switch (relay_.receive(from, message, now_s_)) {
    case Arrival::kNew:
      return std::visit([&](const auto& m) { return take(sender, m); }, *message);
    case Arrival::kRefused:
      return refuse("a message of robot " + std::to_string(sender.robot) +
                    " by another process than the one that is known");
    case Arrival::kNoRoom:
      return refuse("what robot " + std::to_string(from) +
                    " hands over beyond what is held of one robot");
    case Arrival::kRepeated:
    case Arrival::kPassedOn:
    case Arrival::kLost:
      break;
  }
  return true;
}

bool TeamAgent::take(const TeamPeer& sender, const TeamStatus& status) {
  Peer& peer = meet(sender);
  if (!in_order(status))
    return refuse("a status of robot " + std::to_string(sender.robot) + " that is not in order");
  plan_outdated_ = true;
  peer.other_method = status.method != config_.method;
  peer.status = status;
  return !peer.other_method ||
         refuse("robot " + std::to_string(sender.robot) + " is configured for another method");
}

bool TeamAgent::take(const TeamPeer& sender, const Session& session) {
  Peer& peer = meet(sender);
  if (!well_formed(session))
    return refuse("a session of robot " + std::to_string(sender.robot) + " that is not in order");
  peer.session = session;
  consider(session);
  return true;
}

bool TeamAgent::take(const TeamPeer& sender, const MemberPoses& poses) {
  meet(sender);
  if (!in_order(poses))
    return refuse("poses of robot " + std::to_string(sender.robot) + " that are not in order");
  plan_outdated_ = true;
  const auto is_member = [&] {
    return part_ && part_->poses_of(public_poses_, sender.robot, MemberStage::kEntered) != nullptr;
  };
  const bool was_member = is_member();
  public_poses_[sender.robot] = poses;
  if (was_member && poses.session != part_->session().id && state_ == SessionState::kRunning)
    state_ = SessionState::kDeserted;
  if (!is_member()) return true;
  if (in_session()) part_->moved(now_s_);
  if (state_ == SessionState::kSolved) decide_with(poses);
  return true;
}

bool TeamAgent::take(const TeamPeer& sender, const ReliableMessage& message) {
  if (!in_session() || message.session != part_->session().id) return true;  // too early or late
  return part_->receive(message, now_s_) ||
         refuse("a message of robot " + std::to_string(sender.robot) + " that is of no use");
}

TeamOutput TeamAgent::step(double now_s) {
  now_s_ = now_s;
  TeamOutput output;
  watch_links();
  if (graph_.keyframes() > 0) {
    coordinate();
    advance(output);
    reconsider();
  }
  send_status(output);
  if (graph_.keyframes() > 0) publish(output);
  hand_out(output);
  output.verdicts = decisions_.take_verdicts();
  output.notices = notices_.take();
  return output;
}

TeamStatus TeamAgent::make_status() {
  std::vector<EdgeSetOffer> offers = graph_.offers();
  for (EdgeSetOffer& offer : offers)
    decisions_.count_places(offer, *graph_.edges(offer.peer, offer.id));
  return {.sender = self_,
          .receives = relay_.receives(),
          .frame = frame_,
          .frame_version = frame_version_,
          .keyframes = graph_.keyframes(),
          .revision = revision(),
          .offers = std::move(offers),
          .method = config_.method,
          .T_odom_first = graph_.T_odom_first(),
          .upright = graph_.upright()};
}

void TeamAgent::send_status(TeamOutput& output) {
  const double age_s = now_s_ - status_sent_s_;
  if (age_s < kEarlyLinks * config_.status_period_s) return;
  const bool links_changed = !sent_status_ || sent_status_->receives != relay_.receives();
  if (!links_changed && age_s < kEarlyStatus * config_.status_period_s) return;
  TeamStatus status = make_status();
  const bool changed = !sent_status_ || !same_content(status, *sent_status_);
  if (!changed && age_s < config_.status_period_s) return;
  status_sent_s_ = now_s_;
  output.progress = make_progress();
  if (!changed) return relay_.repeat_status(now_s_);
  sent_status_ = status;
  relay_.publish(std::move(status), now_s_);
}

// Messages of the session of this robot count as its bytes, including forwarded ones.
void TeamAgent::hand_out(TeamOutput& output) {
  std::map<const TeamMessage*, std::size_t> sizes;
  for (LinkPacket& packet : relay_.take_packets()) {
    if (part_ && session_of(*packet.message) == part_->session().id) {
      const auto [size, is_new] = sizes.try_emplace(packet.message.get(), 0);
      if (is_new) size->second = encode(*packet.message).size();
      sent_bytes_ += size->second;
    }
    output.packets.push_back(std::move(packet));
  }
}

std::optional<SE3> TeamAgent::world_of(RobotId anchor) const {
  const bool upright = part_ && part_->session().upright;
  // In an upright session, the optimum has a better estimate of the tilt of keyframe 0 than its own
  // vertical.
  const auto world = [&](const SE3& T_frame_first, const SE3& T_odom_first) {
    const SE3 T_frame_world = T_frame_first * T_odom_first.inverse();
    if (!upright) return T_frame_world;
    const Eigen::MatrixXd turned =
        level(T_frame_world.matrix().topRows<3>(), T_odom_first.translation());
    return make_pose(turned.leftCols<3>(), turned.col(3));
  };
  // Uses the pose that all other robots have received, so that all have one frame to the last
  // digit.
  const auto published = public_poses_.find(anchor);
  if (published == public_poses_.end() || published->second.frame != frame_) return std::nullopt;
  const SE3 T_frame_first = published->second.T_frame_kf.front().pose();
  if (anchor == self_.robot) return world(T_frame_first, graph_.T_odom_first());
  const auto peer = peers_.find(anchor);
  if (peer == peers_.end() || !peer->second.status) return std::nullopt;
  return world(T_frame_first, peer->second.status->T_odom_first);
}

// The frame in which this robot publishes. If no closure ties it to the anchor of the session, this
// is the frame of the lowest robot that closures tie to it.
std::optional<TeamAgent::World> TeamAgent::tied_world() const {
  if (!world_ || !std::ranges::binary_search(ties_.untied, world_->anchor)) return world_;
  RobotId anchor = self_.robot;
  for (const SessionMember& member : plan_.members)
    if (!std::ranges::binary_search(ties_.untied, member.peer.robot))
      anchor = std::min(anchor, member.peer.robot);
  const auto T_frame_world = world_of(anchor);
  if (!T_frame_world) return std::nullopt;
  return World{anchor, *T_frame_world};
}

const std::vector<SE3>& TeamAgent::poses() const {
  return in_session() && part_->stage() ? part_->poses() : poses_.T_frame_kf();
}

void TeamAgent::publish(TeamOutput& output) {
  const bool early = now_s_ - published_s_ < config_.publish_period_s;
  if (!world_ || (in_session() && early)) return;
  const auto world = tied_world();
  if (!world || (!publish_due_ && published_anchor_ == world->anchor)) return;
  publish_due_ = false;
  published_s_ = now_s_;
  published_anchor_ = world->anchor;
  Trajectory trajectory{self_.robot, world->anchor, {}};
  const SE3 T_world_frame = world->T_frame_world.inverse();
  for (const SE3& T_frame_kf : poses()) trajectory.T_world_kf.push_back(T_world_frame * T_frame_kf);
  if (state_ == SessionState::kSolved && world->anchor == part_->session().anchor)
    trajectory.covariances = part_->covariances();
  output.trajectory = std::move(trajectory);
  output.progress = make_progress();
}

OptimizerProgress TeamAgent::make_progress() const {
  const auto world = tied_world();
  OptimizerProgress progress{.anchor = world ? world->anchor : self_.robot,
                             .members = {self_.robot}};
  progress.odometry_rotation_noise = graph_.odometry_noise().rotation;
  progress.odometry_translation_noise = graph_.odometry_noise().translation;
  progress.odometry_breaks = static_cast<std::uint32_t>(graph_.odometry_breaks().size());
  progress.round = rounds_before_;
  progress.seconds = optimising_s_;
  if (!part_) return progress;
  const Session& session = part_->session();
  if (in_session() || state_ == SessionState::kSolved) {
    progress.members = part_->members();
    progress.tentative = ties_.tentative;
    progress.untied = ties_.untied;
  }
  progress.round += part_->state().round;
  progress.cost = session.finished ? session.cost : part_->state().cost;
  progress.gradient_norm = session.finished ? session.gradient : part_->state().gradient;
  progress.seconds += part_->moved_s() - started_s_;
  progress.settled = !in_session() && session.finished && !publish_due_ && holds_all(session.plan);
  return progress;
}

bool TeamAgent::holds_all(const SessionPlan& plan) const {
  const auto self = std::find_if(plan.members.begin(), plan.members.end(),
                                 [&](const SessionMember& member) { return member.peer == self_; });
  if (self->revision != revision()) return false;
  std::optional<RobotId> last;
  for (const EdgeSetOffer& offer : graph_.offers()) {
    const bool newest = offer.peer != last;
    last = offer.peer;
    const auto peer = peers_.find(offer.peer);
    if (!newest || peer == peers_.end() || peer->second.other_method ||
        !in_reach({offer.peer, peer->second.boot}))
      continue;
    const SessionPair pair{std::min(self_.robot, offer.peer), std::max(self_.robot, offer.peer),
                           offer.id};
    if (std::find(plan.pairs.begin(), plan.pairs.end(), pair) == plan.pairs.end()) return false;
  }
  return true;
}

}  // namespace km
