#include <algorithm>
#include <utility>

#include "modules/pose_graph/pgo_agent.hpp"

namespace km {
namespace {

// A session that has not moved for so many status periods is replaced.
constexpr double kHopelessPeriods = 10.0;

// After so long without anything new [s] the team has come to rest.
constexpr double kAtRest_s = 2.0;

// The same work, in whatever order and frame.
bool same_graph(const SessionPlan& x, const SessionPlan& y) {
  return x.pairs == y.pairs && std::is_permutation(x.members.begin(), x.members.end(),
                                                   y.members.begin(), y.members.end());
}

bool has_lost_member(const SessionPlan& session, const SessionPlan& now) {
  return std::any_of(session.members.begin(), session.members.end(), [&](const auto& member) {
    return std::none_of(now.members.begin(), now.members.end(),
                        [&](const auto& other) { return other.peer == member.peer; });
  });
}

// Also of hostile origin: nothing that joining relies on is taken for granted.
bool well_formed(const PgoSession& session, int rank, PgoMethod method) {
  std::set<RobotId> robots;
  for (const SessionMember& member : session.plan.members) robots.insert(member.peer.robot);
  const auto known_pair = [&](const SessionPair& pair) {
    return pair.a < pair.b && robots.contains(pair.a) && robots.contains(pair.b);
  };
  const auto& pairs = session.plan.pairs;
  const LiftedPoses& anchor = session.anchor_pose;
  const bool anchor_fits =
      anchor.size() == 0 || (anchor.rows() == rank && anchor.cols() == 4 && anchor.allFinite() &&
                             stiefel_error(anchor) <= 1e-3);
  return session.rank == static_cast<std::uint32_t>(rank) &&
         (session.method == method || session.method == PgoMethod::kRbcd) &&
         robots.size() == session.plan.members.size() && !robots.empty() &&
         *robots.begin() == session.id.coordinator.robot &&
         std::all_of(pairs.begin(), pairs.end(), known_pair) && anchor_fits;
}

bool same_members(const SessionPlan& x, const SessionPlan& y) {
  return x.members.size() == y.members.size() && !has_lost_member(x, y);
}

}  // namespace

void PgoAgent::make_plan() {
  std::map<RobotId, PgoStatus> statuses{{self_.robot, make_status()}};
  for (const auto& [robot, peer] : peers_) {
    if (!peer.alive || !peer.status) continue;
    PgoStatus& status = statuses.emplace(robot, *peer.status).first->second;
    // Poses are sent at once, status now and then.
    if (peer.poses && peer.poses->frame_version > status.frame_version)
      status.frame = peer.poses->frame;
  }
  SessionPlan plan = plan_session(statuses, self_.robot);
  if (!same_graph(plan, plan_)) plan_changed_s_ = now_s_;
  closures_known_ = closures_known(plan, statuses);
  plan_ = std::move(plan);
}

void PgoAgent::coordinate(PgoOutput& output) {
  if (std::exchange(plan_outdated_, false)) {
    make_plan();
    if (const auto session = std::exchange(waiting_, std::nullopt)) join_or_wait(*session);
  }
  if (coordinator_of(plan_) != self_.robot) return;
  if (should_open()) open_session();
  const bool due = now_s_ - session_sent_s_ >= config_.status_period_s;
  if (plan_.members.size() < 2 || !(announce_session_ || due) || !ledger_) return;
  output.session = running_->session;
  announce_session_ = false;
  session_sent_s_ = now_s_;
}

PgoMethod PgoAgent::method_for(const SessionPlan& plan) const {
  const auto is_fixed = [&](const EdgeSetOffer& offer) {
    const auto peer = peers_.find(offer.peer);
    return !plan.has_member(offer.peer) && peer != peers_.end() && peer->second.poses &&
           peer->second.poses->frame == plan.frame;
  };
  // Robots that have gone stay where they are: only the sweep knows poses that do not move.
  const auto ends_on_fixed = [&](const SessionMember& member) {
    const auto offers =
        member.peer == self_ ? graph_.offers() : peers_.at(member.peer.robot).status->offers;
    return std::any_of(offers.begin(), offers.end(), is_fixed);
  };
  const bool any_fixed = std::any_of(plan.members.begin(), plan.members.end(), ends_on_fixed);
  return any_fixed ? PgoMethod::kRbcd : config_.method;
}

bool PgoAgent::all_upright(const SessionPlan& plan) const {
  return std::all_of(plan.members.begin(), plan.members.end(), [&](const SessionMember& member) {
    return member.peer == self_ ? graph_.upright() : peers_.at(member.peer.robot).status->upright;
  });
}

bool PgoAgent::paid_for() const {
  std::size_t most = 0;
  for (const auto& [robot, bytes] : running_->bytes) most = std::max(most, bytes);
  const double price_s = static_cast<double>(most) / (1e3 * config_.exchange_budget_kb_s);
  return now_s_ - running_->moved_s >= std::min(price_s, config_.session_wait_s);
}

bool PgoAgent::worthwhile() const {
  const bool alone = plan_.members.size() == 1;
  if (alone || !same_members(running_->session.plan, plan_)) return true;
  // The first closures join the maps; each further one changes them less. Odometry alone changes
  // nothing: what it adds can wait until the team is at rest.
  const auto used = static_cast<double>(closures_used_);
  const bool grown = closures_known_ != closures_used_ &&
                     static_cast<double>(closures_known_) >= (1.0 + config_.session_growth) * used;
  return grown || now_s_ - plan_changed_s_ >= kAtRest_s ||
         now_s_ - running_->moved_s >= config_.session_wait_s;
}

bool PgoAgent::should_open() const {
  if (!running_) return true;
  const PgoSession& session = running_->session;
  const double still_s = now_s_ - running_->moved_s;
  const bool stalled = still_s > kHopelessPeriods * config_.status_period_s;
  if (same_graph(session.plan, plan_)) return stalled && !session.finished;
  if (session.id.coordinator != self_ || has_lost_member(session.plan, plan_)) return true;
  if (running_->exchange) return session.finished ? paid_for() && worthwhile() : stalled;
  return session.finished || stalled ||
         session.round >= static_cast<std::uint32_t>(config_.min_rounds_per_session);
}

void PgoAgent::open_session() {
  PgoSession session{.id = {self_, ++sessions_opened_}, .plan = plan_};
  session.method = method_for(plan_);
  session.upright = session.method != PgoMethod::kGnc && all_upright(plan_);
  session.rank = static_cast<std::uint32_t>(config_.rank);
  session.max_rounds = static_cast<std::uint32_t>(config_.max_rounds);
  session.anchor = coordinator_of(plan_);
  // `world` stays where it is when its robot has gone.
  if (running_ && running_->session.anchor < session.anchor && frame_ == plan_.frame)
    if (const auto pose = world_of(running_->session.anchor)) {
      session.anchor = running_->session.anchor;
      session.anchor_pose = *pose;
    }
  announce_session_ = join(session);
  if (announce_session_) closures_used_ = closures_known_;
}

bool PgoAgent::accepts(const PgoSession& session) const {
  if (!running_) return true;
  const PgoSessionId& running = running_->session.id;
  if (session.id.coordinator == running.coordinator) return running.number < session.id.number;
  const bool orphaned = running.coordinator != self_ && present(running.coordinator) == nullptr;
  return orphaned || session.id.coordinator.robot <= running.coordinator.robot;
}

bool PgoAgent::receive(const PgoSession& session) {
  if (present(session.id.coordinator) == nullptr ||
      !well_formed(session, config_.rank, config_.method))
    return false;
  const auto& members = session.plan.members;
  const auto self = std::find_if(members.begin(), members.end(),
                                 [&](const SessionMember& member) { return member.peer == self_; });
  if (running_ && session.id == running_->session.id)
    follow(session);
  else if (self != members.end() && accepts(session))
    join_or_wait(session);
  else if (running_ && session.id.coordinator == running_->session.id.coordinator &&
           running_->session.id.number < session.id.number)
    running_.reset();  // the others go on without this robot
  return true;
}

void PgoAgent::join_or_wait(const PgoSession& session) {
  if (!accepts(session)) return;
  // Its coordinator must be known to be connected to this robot, and its edges be at hand.
  const bool connected = plan_.has_member(session.id.coordinator.robot);
  if (!connected || !join(session)) waiting_ = session;
}

void PgoAgent::follow(const PgoSession& session) {
  PgoSession& running = running_->session;
  publish_due_ |= session.finished && !running.finished;
  running.finished |= session.finished;
  if (session.finished) running.anchor_pose = session.anchor_pose;
  if (session.round < running.round) return;  // late
  running.round = session.round;
  running.cost = session.cost;
  running.gradient_norm = session.gradient_norm;
}

}  // namespace km
