#include "modules/session/session_part.hpp"

#include <algorithm>
#include <exception>
#include <set>
#include <stdexcept>

#include "modules/robust/pair_consensus.hpp"
#include "modules/session/frame_entry.hpp"
#include "modules/session/session_schedule.hpp"
#include "modules/session/team_plan.hpp"

namespace km {
namespace {

void add_public_poses(const MemberPoses& poses, std::map<KeyframeId, SE3>& public_poses) {
  for (std::size_t k = 0; k < poses.keyframes.size(); ++k)
    public_poses[{poses.sender.robot, poses.keyframes[k]}] = poses.T_frame_kf[k].pose();
}

// Adds the received poses of a robot that is not a member, and the closures to these poses.
void add_absent(const MemberPoses& poses, RobotId self, std::span<const PoseEdge> edges,
                SessionGraph& graph) {
  add_public_poses(poses, graph.public_poses);
  for (const PoseEdge& e : edges)
    if (graph.public_poses.contains(e.other(self))) graph.to_absent.push_back(e);
}

// Limit of the messages kept before there is a solver. Senders repeat the messages beyond it.
constexpr std::size_t kMaxEarlyMessages = 1000;
constexpr std::size_t kMaxEarlyBytes = 1U << 26U;

}  // namespace

std::optional<FrozenPart> freeze_part(const Session& session, RobotId self, const OwnGraph& graph,
                                      std::span<const RobotId> peers, const PublicPoses& results) {
  const SessionPlan& plan = session.plan;
  FrozenPart part{.place = *place_in(plan, self)};
  SessionGraph& frozen = part.graph;
  frozen.self = self;
  for (const SessionPair& pair : plan.pairs) {
    if (pair.a != self && pair.b != self) continue;
    const auto* edges = graph.edges(pair.a == self ? pair.b : pair.a, pair.edges);
    if (edges == nullptr) return std::nullopt;
    frozen.between.insert(frozen.between.end(), edges->begin(), edges->end());
  }
  std::ranges::sort(frozen.between, {}, &PoseEdge::id);
  std::set<KeyframeIndex> ends{0};
  for (const RobotId robot : peers) {
    const std::span<const PoseEdge> edges = graph.newest_edges(robot);
    if (edges.empty()) continue;
    for (const PoseEdge& e : edges) ends.insert(e.end_on(self).index);
    const auto poses = results.find(robot);
    if (!plan.has_member(robot) && poses != results.end() && poses->second.frame == plan.frame)
      add_absent(poses->second, self, edges, frozen);
  }
  for (const PoseEdge& e : frozen.between) ends.insert(e.end_on(self).index);
  frozen.datum_ties = datum_ties(plan, self);
  part.public_keyframes.assign(ends.begin(), ends.end());
  frozen.own = graph.own_edges();
  frozen.odometry = graph.keyframes() - 1;
  frozen.step_precision[self] = graph.mean_step_precision();
  frozen.odometry_precision[self] = graph.odometry_noise().corrected({});
  frozen.closure_precision[self] = graph.odometry_noise().corrected_closure({});
  frozen.later_runs[self] = graph.later_runs();
  frozen.upright = session.upright;
  frozen.origin = {plan.has_member(session.anchor) ? session.anchor : coordinator_of(plan), 0};
  if (session.upright) frozen.verticals = graph.verticals();
  return part;
}

SessionPart::SessionPart(Session session, TeamPeer self, FrozenPart part,
                         MemberSolverFactory factory, double now_s)
    : session_(std::move(session)),
      self_(self),
      graph_(std::move(part.graph)),
      place_(std::move(part.place)),
      in_frame_(part.in_frame),
      closures_may_be_false_(part.closures_may_be_false),
      public_(std::move(part.public_keyframes)),
      factory_(std::move(factory)),
      channel_(self, session_.id, kTeamStatusPeriod_s),
      cost_{now_s, now_s} {
  for (const SessionMember& member : session_.plan.members)
    boot_of_[member.peer.robot] = member.peer.boot;
  for (const PoseEdge& e : graph_.between) between_.push_back(e.id());
}

const MemberPoses* SessionPart::poses_of(const PublicPoses& published, RobotId robot,
                                         MemberStage stage) const {
  const auto member = boot_of_.find(robot);
  const auto poses = published.find(robot);
  const bool has = member != boot_of_.end() && poses != published.end() &&
                   poses->second.sender.boot == member->second &&
                   poses->second.session == session_.id && poses->second.stage >= stage;
  return has ? &poses->second : nullptr;
}

bool SessionPart::all_solved(const PublicPoses& published) const {
  return stage() == MemberStage::kSolved &&
         std::all_of(boot_of_.begin(), boot_of_.end(), [&](const auto& member) {
           if (member.first == self_.robot) return true;
           const MemberPoses* poses = poses_of(published, member.first, MemberStage::kSolved);
           return poses != nullptr && poses->stage == MemberStage::kSolved;
         });
}

bool SessionPart::joins_members(const ClosureId& closure) const {
  return std::binary_search(between_.begin(), between_.end(), closure);
}

SessionWork SessionPart::advance(const PublicPoses& published, double now_s) {
  if (state_ == SessionState::kEntering) {
    work_.any = in_frame_ || align(published);
    if (work_.any) {
      round_public_poses();
      take(SessionEvent::kEntered);
    }
  } else if (state_ == SessionState::kGathering || state_ == SessionState::kLooking) {
    work_.any = gather(published);
    if (work_.any) start_solver(now_s);
  } else if (solver_ && state_ != SessionState::kFailed && (solver_->ready() || solver_->done())) {
    work_.any = true;
    solve(now_s);
  }
  if (work_.any) cost_.last_activity_s = now_s;
  for (ReliableMessage& message : channel_.due(now_s)) work_.messages.push_back(std::move(message));
  return std::exchange(work_, {});
}

// A pose that is rounded twice may differ from the pose that is rounded once, because the
// quaternion is normalised in between. Copies of a pose on two robots that differ at all drift
// apart: the same step of the solver moves them along different axes.
std::vector<SinglePose> SessionPart::public_poses() const {
  if (stage() != MemberStage::kSolved) return entered_;
  std::vector<SinglePose> rounded;
  for (const KeyframeIndex keyframe : public_)
    rounded.push_back(SinglePose::of(result_.poses[keyframe]));
  return rounded;
}

void SessionPart::round_public_poses() {
  entered_.clear();
  for (const KeyframeIndex keyframe : public_) {
    SE3& T = graph_.start[keyframe];
    entered_.push_back(SinglePose::of(T));
    T = entered_.back().pose();
  }
}

bool SessionPart::align(const PublicPoses& published) {
  std::map<KeyframeId, SE3> poses = graph_.public_poses;  // poses of absent robots
  for (const SessionMember& member : session_.plan.members) {
    if (member.peer == self_) break;
    const auto ends_there = [&](const PoseEdge& e) {
      return e.other(self_.robot).robot == member.peer.robot;
    };
    if (std::ranges::none_of(graph_.between, ends_there) &&
        std::ranges::none_of(graph_.datum_ties, ends_there))
      continue;
    const MemberPoses* of_member = poses_of(published, member.peer.robot, MemberStage::kEntered);
    if (of_member == nullptr) return false;
    add_public_poses(*of_member, poses);
  }
  std::vector<PoseEdge> closures = graph_.between;
  closures.insert(closures.end(), graph_.to_absent.begin(), graph_.to_absent.end());
  // A datum tie alone is enough, because several fixes agree on it; closures may all be false.
  std::optional<std::vector<SE3>> moved;
  for (const auto* edges : {&graph_.datum_ties, &closures})
    if (!moved) moved = moved_into_frame(graph_.start, self_.robot, *edges, poses);
  if (!moved) return false;
  closures.insert(closures.end(), graph_.datum_ties.begin(), graph_.datum_ties.end());
  graph_.start = closures_may_be_false_
                     ? std::move(*moved)
                     : deformed_to_received(*moved, self_.robot, graph_.own, closures, poses);
  return true;
}

bool SessionPart::gather(const PublicPoses& published) {
  for (const auto& [robot, boot] : boot_of_)
    if (robot != self_.robot && poses_of(published, robot, *stage()) == nullptr) return false;
  for (const auto& [robot, boot] : boot_of_) {
    if (robot == self_.robot) continue;
    const MemberPoses& poses = *poses_of(published, robot, *stage());
    add_public_poses(poses, graph_.public_poses);
    if (!graph_.again) graph_.step_precision[robot] = poses.step_precision;
    graph_.odometry_precision[robot] = poses.odometry_precision;
    graph_.closure_precision[robot] = poses.closure_precision;
    graph_.later_runs[robot] = poses.later_runs;
    for (const auto& [id, kept] : poses.verdicts)
      if (graph_.again && joins_members(id)) graph_.decided[id] = kept;
  }
  if (!graph_.again && closures_may_be_false_) limit_precisions(graph_);
  take(SessionEvent::kGathered);
  return true;
}

void SessionPart::start_solver(double now_s) {
  try {
    for (const PoseEdge& e : graph_.between)
      if (!graph_.public_poses.contains(e.other(self_.robot)))
        throw std::runtime_error("a closure ends on " + to_string(e.other(self_.robot)) +
                                 ", whose pose its robot has not published");
    solver_ = factory_(session_, graph_, place_);
  } catch (const std::exception& e) {
    return fail(e.what());
  }
  cost_.last_activity_s = now_s;
  for (const auto& [from, message] : std::exchange(early_, {}))
    if (!pass_to_solver(message, now_s)) work_.refused.push_back(from.first);
}

void SessionPart::solve(double now_s) {
  std::vector<SolverMessage> messages;
  try {
    messages = solver_->advance();
  } catch (const std::exception& e) {
    return fail(e.what());
  }
  for (SolverMessage& message : messages)
    if (boot_of_.contains(message.to) && message.to != self_.robot)
      work_.messages.push_back(channel_.write(std::move(message), now_s));
  if (!solver_->done()) return;
  const SolverState state = solver_->state();
  if (state.failed) return fail("the team's equations cannot be solved");
  result_ = {.state = progress(),
             .verdicts = solver_->verdicts(),
             .noise = solver_->noise(),
             .covariances = solver_->covariances(),
             .poses = solver_->poses()};
  solver_.reset();
  if (state.deferred && state_ == SessionState::kSolving) return look_again();
  take(SessionEvent::kConverged);
  graph_ = {};
}

void SessionPart::look_again() {
  graph_.again = true;
  graph_.first_barc = result_.state.barc;
  graph_.start = result_.poses;
  graph_.noise = result_.noise;
  for (const auto& [id, kept] : result_.verdicts.closures) graph_.decided[id] = kept;
  round_public_poses();
  take(SessionEvent::kDeferred);
}

void SessionPart::fail(const std::string& why) {
  result_.failure = why;
  take(SessionEvent::kBroken);
}

bool SessionPart::receive(const ReliableMessage& message, double now_s) {
  const auto member = boot_of_.find(message.sender.robot);
  if (message.sender.robot == self_.robot || member == boot_of_.end() ||
      member->second != message.sender.boot)
    return false;
  switch (channel_.read(message, now_s)) {
    case ReliableArrival::kNone:
      return true;
    case ReliableArrival::kFalse:
      return false;
    case ReliableArrival::kNew:
      break;
  }
  if (solver_ || stage() == MemberStage::kSolved) return pass_to_solver(message, now_s);
  const std::size_t bytes = early_bytes_ + message.bytes->size();
  if (early_.size() >= kMaxEarlyMessages || bytes > kMaxEarlyBytes) return true;
  if (early_.try_emplace({message.sender.robot, message.number}, message).second)
    early_bytes_ = bytes;
  return true;
}

// Once there is a solution, messages are no longer needed.
bool SessionPart::pass_to_solver(const ReliableMessage& message, double now_s) {
  if (solver_ && !solver_->receive(message.sender.robot, *message.bytes)) return false;
  channel_.take(message);
  cost_.last_activity_s = now_s;
  return true;
}

bool SessionPart::follow(const Session& session) {
  session_.round = session.round;
  session_.cost = session.cost;
  session_.gradient = session.gradient;
  if (session.T_frame_world) session_.T_frame_world = session.T_frame_world;
  const bool ends = session.finished && !session_.finished;
  session_.finished |= session.finished;
  return ends;
}

// Rounds are those of both looks.
SolverState SessionPart::progress() const {
  if (!solver_) return result_.state;
  SolverState state = solver_->state();
  state.round += result_.state.round;
  return state;
}

}  // namespace km
