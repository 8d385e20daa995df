#include "modules/pose_graph/pgo_agent.hpp"

#include <algorithm>
#include <cmath>

#include "modules/pose_graph/rounding.hpp"

namespace km {
namespace {

// A status that has changed is sent again after this part of the period at the earliest.
constexpr double kEarlyStatus = 0.5;
constexpr double kFeasible = 1e-3;  // single precision leaves 1e-6

bool well_formed(const PublicPoses& poses, int rank) {
  const auto& keyframes = poses.keyframes;
  return !keyframes.empty() && keyframes.front() == 0 &&
         std::adjacent_find(keyframes.begin(), keyframes.end(), std::greater_equal<>()) ==
             keyframes.end() &&
         poses.X.rows() == rank &&
         poses.X.cols() == 4 * static_cast<Eigen::Index>(keyframes.size()) && poses.X.allFinite() &&
         stiefel_error(poses.X) <= kFeasible && std::isfinite(poses.cost) &&
         std::isfinite(poses.squared_gradient);
}

// Nobody speaks for another robot.
bool speaks_for_itself(const SolverMessage& message) {
  const auto of_sender = [&](const auto& content) {
    if constexpr (requires { content.robot; }) return content.robot == message.sender.robot;
    return true;
  };
  return std::visit(of_sender, message.content);
}

}  // namespace

PgoAgent::PgoAgent(const PoseGraphConfig& config, PgoPeer self)
    : config_(checked(config)), self_(self), graph_(self.robot), frame_(self) {}

bool PgoAgent::add(const KeyframeOdometry& keyframe) {
  const bool taken = graph_.add(keyframe);
  plan_outdated_ |= taken;
  return taken;
}

bool PgoAgent::add(const Closure& closure) {
  const bool taken = graph_.add(closure);
  plan_outdated_ |= taken;
  return taken;
}

bool PgoAgent::add(const InlierSet& set) {
  const bool taken = graph_.add(set);
  plan_outdated_ |= taken;
  return taken;
}

void PgoAgent::peer_alive(PgoPeer peer) {
  if (peer.robot == self_.robot) return;
  Peer& entry = peers_.try_emplace(peer.robot, Peer{.boot = peer.boot}).first->second;
  if (entry.boot != peer.boot) {
    graph_.forget(peer.robot);
    std::erase_if(rejected_, [&](const ClosureId& id) {
      return id.from.robot == peer.robot || id.to.robot == peer.robot;
    });
    entry = Peer{.boot = peer.boot};
  }
  entry.alive = true;
  plan_outdated_ = true;
}

void PgoAgent::peer_lost(RobotId robot) {
  const auto known = peers_.find(robot);
  if (known == peers_.end()) return;
  known->second.alive = false;
  plan_outdated_ = true;
}

const PgoAgent::Peer* PgoAgent::present(PgoPeer peer) const {
  const auto known = peers_.find(peer.robot);
  const bool is = known != peers_.end() && known->second.alive && known->second.boot == peer.boot;
  return is ? &known->second : nullptr;
}

PgoAgent::Peer* PgoAgent::sender_of_message(PgoPeer peer) {
  if (peer.robot == self_.robot) return nullptr;
  Peer& entry = peers_.try_emplace(peer.robot, Peer{.boot = peer.boot}).first->second;
  return entry.boot == peer.boot ? &entry : nullptr;
}

bool PgoAgent::receive(const PgoStatus& status) {
  Peer* sender = sender_of_message(status.sender);
  if (sender == nullptr) return false;
  sender->other_method = status.method != config_.method;
  if (sender->other_method) return false;
  sender->status = status;
  plan_outdated_ = true;
  return true;
}

bool PgoAgent::receive(PublicPoses poses) {
  if (!well_formed(poses, config_.rank)) return false;
  Peer* sender = sender_of_message(poses.sender);
  if (sender == nullptr) return false;
  const auto& newest = sender->poses;
  const bool stale = newest && newest->session.coordinator == poses.session.coordinator &&
                     std::pair(poses.session.number, poses.round) <
                         std::pair(newest->session.number, newest->round);
  if (stale) return true;
  poses.X = restore_stiefel(std::move(poses.X));
  sender->poses = std::move(poses);
  count_share(*newest);
  return true;
}

bool PgoAgent::receive(const SolverMessagePtr& message) {
  Peer* sender = sender_of_message(message->sender);
  if (sender == nullptr || !speaks_for_itself(*message)) return false;
  SolverMessagePtr& kept = sender->exchange[slot_of(message->sequence)];
  const bool stale = kept && kept->session.coordinator == message->session.coordinator &&
                     std::pair(message->session.number, message->sequence) <
                         std::pair(kept->session.number, kept->sequence);
  if (stale) return true;
  const bool repeated =
      kept && kept->session == message->session && kept->sequence == message->sequence;
  if (!repeated && running_ && message->session == running_->session.id)
    running_->bytes[message->sender.robot] += approximate_bytes(*message);
  kept = message;
  take_in(message);
  return true;
}

PgoOutput PgoAgent::step(double now_s) {
  now_s_ = now_s;
  PgoOutput output;
  if (graph_.keyframes() == 0) return output;
  coordinate(output);
  advance(output);
  send_status(output);
  publish(output);
  return output;
}

PgoStatus PgoAgent::make_status() const {
  return {.sender = self_,
          .frame = frame_,
          .frame_version = frame_version_,
          .keyframes = graph_.keyframes(),
          .revision = graph_.revision(),
          .offers = graph_.offers(),
          .method = config_.method,
          .T_odom_first = graph_.T_odom_first(),
          .upright = graph_.upright()};
}

void PgoAgent::send_status(PgoOutput& output) {
  const double age_s = now_s_ - status_sent_s_;
  if (age_s < kEarlyStatus * config_.status_period_s) return;
  PgoStatus status = make_status();
  if (age_s < config_.status_period_s && status == sent_status_) return;
  status_sent_s_ = now_s_;
  sent_status_ = status;
  output.progress = make_progress();
  output.status = std::move(status);
}

std::optional<Eigen::MatrixXd> PgoAgent::world_of(RobotId anchor) const {
  if (running_ && running_->exchange && running_->session.finished &&
      anchor == running_->session.anchor && running_->session.anchor_pose.cols() == 4)
    return running_->session.anchor_pose;
  // Upright, the optimum knows better than keyframe 0 did how that was tilted.
  const bool upright = running_ && running_->session.upright;
  const auto before = [upright](const LiftedPoses& X, const SE3& T_odom_first) {
    const Eigen::MatrixXd world = lift(Eigen::MatrixXd(X.leftCols<4>()), T_odom_first.inverse());
    return upright ? level(world, T_odom_first.translation()) : world;
  };
  // What the others know it as: then all are in one frame to the last digit.
  if (anchor == self_.robot)
    return before(sent_poses_ ? restore_stiefel(sent_poses_->X.leftCols<4>()) : block_->X(),
                  graph_.T_odom_first());
  const auto peer = peers_.find(anchor);
  if (peer != peers_.end() && peer->second.poses && peer->second.status &&
      peer->second.poses->frame == frame_)
    return before(peer->second.poses->X, peer->second.status->T_odom_first);
  const PgoSession& session = running_->session;
  if (anchor == session.anchor && session.anchor_pose.cols() == 4) return session.anchor_pose;
  return std::nullopt;
}

// True while it is not known where the anchor, which moves, too, is after the last exchange.
bool PgoAgent::awaits_anchor() const {
  const PgoSession& session = running_->session;
  if (!running_->exchange || session.finished) return false;
  const bool moves =
      session.anchor != self_.robot && running_->position_of.contains(session.anchor);
  return *running_->round > 0 || (moves && poses_in_session(session.anchor, 0) == nullptr);
}

void PgoAgent::publish(PgoOutput& output) {
  const bool running = running_ && !running_->session.finished;
  if (!block_ || !publish_due_ || (running && now_s_ - published_s_ < config_.publish_period_s))
    return;
  const bool in_frame = running_ && running_->round;
  const RobotId anchor = in_frame ? running_->session.anchor : self_.robot;
  const auto pose = world_of(anchor);
  if (!pose || (in_frame && awaits_anchor())) return;
  publish_due_ = false;
  published_s_ = now_s_;
  output.trajectory = Trajectory{self_.robot, anchor, round_to_poses(block_->X(), *pose)};
  output.progress = make_progress();
}

OptimizerProgress PgoAgent::make_progress() const {
  OptimizerProgress progress{.anchor = self_.robot, .members = {self_.robot}};
  progress.round = total_rounds_;
  progress.seconds = optimising_s_;
  if (!running_) return progress;
  const PgoSession& session = running_->session;
  progress.anchor = session.anchor;
  progress.members.clear();
  for (const auto& [robot, position] : running_->position_of) progress.members.push_back(robot);
  progress.cost = session.cost;
  progress.gradient_norm = session.gradient_norm;
  progress.seconds += running_->moved_s - running_->started_s;
  progress.settled = session.finished && !publish_due_ && holds_all(session.plan);
  return progress;
}

bool PgoAgent::holds_all(const SessionPlan& plan) const {
  if (plan.members[running_->position_of.at(self_.robot)].revision != graph_.revision())
    return false;
  std::optional<RobotId> last;
  for (const EdgeSetOffer& offer : graph_.offers()) {
    const bool newest = offer.peer != last;
    last = offer.peer;
    const auto peer = peers_.find(offer.peer);
    if (!newest || peer == peers_.end() || !peer->second.alive || peer->second.other_method)
      continue;
    const SessionPair pair{std::min(self_.robot, offer.peer), std::max(self_.robot, offer.peer),
                           offer.id};
    if (std::find(plan.pairs.begin(), plan.pairs.end(), pair) == plan.pairs.end()) return false;
  }
  return true;
}

}  // namespace km
