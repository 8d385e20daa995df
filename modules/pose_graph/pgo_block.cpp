#include <algorithm>
#include <utility>

#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/pgo_agent.hpp"
#include "modules/pose_graph/robust/gnc_schedule.hpp"

namespace km {
namespace {

// After so many status periods without an update a member sends its last messages again.
constexpr double kStalledPeriods = 3.0;
constexpr int kAlignmentSteps = 10;  // Newton steps of the first solution beside aligned peers

}  // namespace

std::optional<PgoAgent::EdgesTo> PgoAgent::edges_in(const SessionPlan& plan) const {
  EdgesTo edges;
  for (const SessionPair& pair : plan.pairs) {
    if (pair.a != self_.robot && pair.b != self_.robot) continue;
    const RobotId peer = pair.a == self_.robot ? pair.b : pair.a;
    const auto* of_peer = graph_.edges(peer, pair.edges);
    if (of_peer == nullptr) return std::nullopt;
    edges.emplace(peer, *of_peer);
  }
  return edges;
}

PgoAgent::EdgesTo PgoAgent::edges_to_absent(const SessionPlan& plan) const {
  EdgesTo edges;
  for (const auto& [robot, peer] : peers_) {
    const auto* of_peer = graph_.newest_edges(robot);
    if (plan.has_member(robot) || of_peer == nullptr || !peer.poses ||
        peer.poses->frame != plan.frame)
      continue;
    const auto& keyframes = peer.poses->keyframes;
    for (const InterEdge& e : *of_peer)
      if (std::binary_search(keyframes.begin(), keyframes.end(), e.other))
        edges[robot].push_back(e);
  }
  return edges;
}

std::vector<VerticalPrior> PgoAgent::verticals_in(const PgoSession& session) const {
  return session.upright ? graph_.verticals() : std::vector<VerticalPrior>();
}

LiftedPoses PgoAgent::extended_poses() const {
  const Eigen::Index known = block_ ? pose_count(block_->X()) : 0;
  LiftedPoses X(config_.rank, 4 * Eigen::Index{graph_.keyframes()});
  X.leftCols(4 * known) = block_ ? block_->X() : LiftedPoses(config_.rank, 0);
  for (Eigen::Index i = known; i < pose_count(X); ++i)
    X.middleCols<4>(4 * i) =
        i == 0 ? lift(lifted_identity(config_.rank), graph_.T_odom_first())
               : lift(X.middleCols<4>(4 * (i - 1)), graph_.step_to(static_cast<std::uint32_t>(i)));
  return X;
}

void PgoAgent::start_block(const PgoSession& session, EdgesTo edges, const EdgesTo& absent) {
  const SessionPlan& plan = session.plan;
  edges.insert(absent.begin(), absent.end());
  std::vector<BlockEdge> own_edges = graph_.own_edges();
  loosen_rejected(own_edges, edges);
  block_.emplace(extended_poses(), own_edges, edges, verticals_in(session));
  for (const auto& [robot, to_absent] : absent) {
    const PublicPoses& poses = *peers_.at(robot).poses;
    (void)block_->set_neighbour(robot, poses.keyframes, poses.X);
  }
  // Alone, nothing ties the block to its present place: closures may call for a better start.
  const std::size_t intra_closures = own_edges.size() + 1 - graph_.keyframes();
  // Not if they may be false.
  const bool trusted = config_.method != PgoMethod::kGnc;
  if (trusted && plan.members.size() == 1 && edges.empty() &&
      intra_closures != intra_closures_tried_) {
    auto poses = chordal_initialisation(Eigen::Index{graph_.keyframes()}, own_edges);
    for (SE3& T : poses) T = graph_.T_odom_first() * T;
    block_->offer(lift(poses, config_.rank));
    intra_closures_tried_ = intra_closures;
  }
}

void PgoAgent::loosen_rejected(std::vector<BlockEdge>& own, EdgesTo& edges) const {
  if (rejected_.empty()) return;
  const auto loosen = [&](const ClosureId& id, double& kappa, double& tau) {
    if (!rejected_.contains(id)) return;
    kappa *= kJointWeight;
    tau *= kJointWeight;
  };
  for (std::size_t k = graph_.keyframes() - 1; k < own.size(); ++k)  // after odometry
    loosen(closure_id(self_.robot, own[k]), own[k].kappa, own[k].tau);
  for (auto& [peer, list] : edges)
    for (InterEdge& e : list) loosen(closure_id(self_.robot, peer, e), e.kappa, e.tau);
}

bool PgoAgent::join(const PgoSession& session) {
  const SessionPlan& plan = session.plan;
  auto edges = edges_in(plan);
  if (!edges) return false;
  const EdgesTo absent = edges_to_absent(plan);
  std::optional<Exchange> exchange;
  if (session.method != PgoMethod::kRbcd)
    exchange.emplace(Exchange{.edges = {self_.robot, Eigen::Index{graph_.keyframes()},
                                        graph_.own_edges(), *edges, verticals_in(session)}});
  start_block(session, std::move(*edges), absent);
  if (running_) optimising_s_ += running_->moved_s - running_->started_s;
  Running& running = running_.emplace(Running{.session = session});
  running.exchange = std::move(exchange);
  running.started_s = running.moved_s = running.sent_s = now_s_;
  for (std::size_t k = 0; k < plan.members.size(); ++k)
    running.position_of[plan.members[k].peer.robot] = k;
  const std::size_t position = running.position_of.at(self_.robot);
  for (const auto& [robot, at] : running.position_of)
    if (at < position) running.counted.insert(robot);
  for (const auto& [robot, to_absent] : absent) running.counted.insert(robot);
  ledger_.reset();
  if (session.id.coordinator == self_) {
    std::set<RobotId> members;
    for (const SessionMember& member : plan.members) members.insert(member.peer.robot);
    ledger_.emplace(members);
  }
  sent_poses_.reset();
  return true;
}

const PublicPoses* PgoAgent::poses_in_session(RobotId robot, std::uint32_t round) const {
  const auto peer = peers_.find(robot);
  const bool found = peer != peers_.end() && peer->second.poses &&
                     peer->second.poses->session == running_->session.id &&
                     peer->second.poses->round >= round;
  return found ? &*peer->second.poses : nullptr;
}

bool PgoAgent::hear_neighbours() {
  const std::size_t position = running_->position_of.at(self_.robot);
  bool any = false;
  for (const RobotId robot : block_->neighbours()) {
    const auto member = running_->position_of.find(robot);
    const bool absent = member == running_->position_of.end();  // set once, when joining
    const bool before = !absent && member->second < position;
    any |= absent || before;
    if (absent || (!running_->round && !before)) continue;  // the latter are aligned later
    const std::uint32_t round = running_->round ? *running_->round + (before ? 1 : 0) : 0;
    const PublicPoses* poses = poses_in_session(robot, round);
    if (poses == nullptr || !block_->set_neighbour(robot, poses->keyframes, poses->X)) return false;
  }
  return any || running_->round;
}

void PgoAgent::advance(PgoOutput& output) {
  if (!running_ || running_->session.finished) return;
  if (!running_->round) return align(output);
  if (running_->exchange) return exchange(output);
  sweep(output);
}

void PgoAgent::align(PgoOutput& output) {
  const PgoFrame& frame = running_->session.plan.frame;
  if (frame_ != frame && running_->position_of.at(self_.robot) != 0) {
    if (!hear_neighbours()) return repeat_if_silent(output);
    // False closures would bend the odometry that gnc weighs them by.
    const bool trusted = config_.method != PgoMethod::kGnc;
    const TruncatedNewtonOptions options{.max_iterations = trusted ? kAlignmentSteps : 0,
                                         .max_cg_iterations = config_.max_cg_iterations};
    block_->align({config_.alignment_rotation_rad, config_.alignment_translation_m}, options);
  }
  enter_frame(output);
}

void PgoAgent::enter_frame(PgoOutput& output) {
  const PgoFrame& frame = running_->session.plan.frame;
  if (frame_ != frame) ++frame_version_;
  frame_ = frame;
  running_->round = 0;
  plan_outdated_ = true;
  // Members after this one may not be in the frame yet: nobody has a share of the cost.
  send_poses(running_->exchange ? rounded_public_poses() : block_->round_public_poses(), 0.0, 0.0,
             output);
}

LiftedPoses PgoAgent::rounded_public_poses() const {
  const std::vector<std::uint32_t>& keyframes = block_->public_keyframes();
  LiftedPoses rounded(config_.rank, 4 * static_cast<Eigen::Index>(keyframes.size()));
  for (std::size_t k = 0; k < keyframes.size(); ++k)
    rounded.middleCols<4>(4 * static_cast<Eigen::Index>(k)) =
        block_->X().middleCols<4>(4 * Eigen::Index{keyframes[k]}).cast<float>().cast<double>();
  return rounded;
}

void PgoAgent::send_poses(LiftedPoses rounded, double cost, double squared_gradient,
                          PgoOutput& output) {
  PublicPoses poses{.sender = self_, .session = running_->session.id, .frame = frame_};
  poses.frame_version = frame_version_;
  poses.round = *running_->round;
  poses.cost = cost;
  poses.squared_gradient = squared_gradient;
  poses.keyframes = block_->public_keyframes();
  poses.X = std::move(rounded);
  running_->moved_s = running_->sent_s = now_s_;
  publish_due_ = true;
  output.more = true;
  if (running_->session.plan.members.size() > 1) {
    running_->bytes[self_.robot] +=
        4 * (poses.keyframes.size() + static_cast<std::size_t>(poses.X.size()));
    sent_poses_ = output.poses = poses;
  }
  count_share(poses);
}

void PgoAgent::repeat_if_silent(PgoOutput& output) {
  if (now_s_ - running_->sent_s <= kStalledPeriods * config_.status_period_s) return;
  running_->sent_s = now_s_;
  output.poses = sent_poses_;
  for (const SolverMessagePtr& message : running_->last_sent)
    if (message) output.exchange.push_back(message);
}

}  // namespace km
