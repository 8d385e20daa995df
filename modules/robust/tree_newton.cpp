#include "modules/robust/tree_newton.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "modules/core/lie.hpp"
#include "modules/robust/corroboration.hpp"
#include "modules/robust/odometry_evidence.hpp"
#include "modules/tree_newton/closure_cover.hpp"

namespace km {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Next = TreeVerdict::Next;
using Weighing = TreeVerdict::Weighing;

// Weight of a rejected closure in the equations. Small enough not to bias the solution, positive so
// that the system stays regular.
constexpr double kFloor = 1e-10;
// Largest distance of a pose from the origin; beyond it, single precision overflows.
constexpr double kMaxDistance_m = 1e15;
constexpr double kLongestStep = 1e30;
// Maximum number of cycles per robot pair in the noise estimate. With four or more robots it is
// smaller, so that one robot cannot dominate the estimate.
constexpr std::size_t kEnoughLengths = 300;
constexpr std::size_t kShareOfLengths = 60;
constexpr double kWorthIt = 1.5;

bool is_within_limits(const SE3& T) {
  return T.matrix().allFinite() && T.translation().norm() <= kMaxDistance_m;
}

// The ends of `closures` on `child` if they are at most kWorthIt times as many as `cover`,
// otherwise `cover`. With these ends the parent weighs all closures to the child. The child then
// sends its second derivatives once, where those with weights that change are sent again and again.
std::vector<KeyframeId> ends_if_few(std::span<const ClosureId> closures, RobotId child,
                                    std::vector<KeyframeId> cover) {
  std::set<KeyframeId> ends;
  for (const ClosureId& closure : closures)
    ends.insert(closure.from.robot == child ? closure.from : closure.to);
  if (static_cast<double>(ends.size()) > kWorthIt * static_cast<double>(cover.size())) return cover;
  return {ends.begin(), ends.end()};
}

// Rounding a step, which vanishes at the optimum, does not slow down Newton's method. Right-hand
// sides of a part of the team do not vanish there: their rounding would remain in the solution. The
// step of a robot whose equations are singular to rounding may be too long for a float.
MatrixXd in_single_precision(const MatrixXd& X) {
  return X.cwiseMax(-kLongestStep).cwiseMin(kLongestStep).cast<float>().cast<double>();
}

SolverMessage message_to(RobotId to, std::vector<std::uint8_t> bytes) {
  return {to, std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes))};
}

}  // namespace

TreeNewton::TreeNewton(SessionGraph graph, TreePlace place, const TreeNewtonOptions& options)
    : graph_(std::move(graph)),
      place_(std::move(place)),
      options_(options),
      inside_(graph_.own.size()),
      accepted_(graph_.start) {
  known_.reserve(inside_ + graph_.between.size());
  for (const PoseEdge& e : std::exchange(graph_.own, {}))
    known_.push_back({.edge = e, .odometry = known_.size() < graph_.odometry});
  for (const PoseEdge& e : graph_.between) {
    (void)start_of(e.from);
    (void)start_of(e.to);
    known_.push_back({.edge = e});
  }
  classify();
  weaken_odometry();  // in a second look
  if (!place_.parent) root_.emplace(place_.members, options_, graph_.upright, graph_.again);
}

const SE3& TreeNewton::start_of(const KeyframeId& id) const {
  if (id.robot == graph_.self && id.index < graph_.start.size()) return graph_.start[id.index];
  const auto found = graph_.public_poses.find(id);
  if (found == graph_.public_poses.end())
    throw std::invalid_argument("TreeNewton: no robot has published pose " + to_string(id));
  return found->second;
}

// Both robots of a pair classify its closures equally.
void TreeNewton::classify() {
  if (!options_.robust) return;
  for (const auto& [peer, closures] : by_peer()) {
    const bool any_new = std::any_of(closures.begin(), closures.end(), [&](std::size_t k) {
      return !graph_.decided.contains(known_[k].edge.id());
    });
    for (const std::size_t k : closures) {
      const auto decided = graph_.decided.find(known_[k].edge.id());
      if (decided != graph_.decided.end() && !decided->second)
        known_[k].trust = Trust::kRejected;
      else if (any_new)
        known_[k].trust = Trust::kOpen;
    }
  }
}

// Indices in known_ of closures, by the other robot of the pair; closures inside this robot by its
// own id.
std::map<RobotId, std::vector<std::size_t>> TreeNewton::by_peer() const {
  std::map<RobotId, std::vector<std::size_t>> closures;
  for (std::size_t k = graph_.odometry; k < known_.size(); ++k)
    closures[peer_of(known_[k])].push_back(k);
  return closures;
}

RobotId TreeNewton::peer_of(const Known& k) const {
  return k.edge.from.robot == graph_.self ? k.edge.to.robot : k.edge.from.robot;
}

// True if this robot reports the closure: of both robots that know it, only the one with the lower
// id does.
bool TreeNewton::reports(const Known& k) const {
  return graph_.self <= std::min(k.edge.from.robot, k.edge.to.robot);
}

// Decides the closures inside this robot by its start, see relaxed_start(). Their weights then do
// not change from round to round, nor do the second derivatives that this robot sends.
void TreeNewton::settle() {
  if (place_.members.size() < 2) return;
  std::vector<PoseEdge> open;
  for (std::size_t k = graph_.odometry; k < inside_; ++k)
    if (known_[k].trust == Trust::kOpen) open.push_back(known_[k].edge);
  if (!mostly_fit(open, graph_.start, verdict_.barc)) return;
  for (std::size_t k = graph_.odometry; k < inside_; ++k) {
    Known& known = known_[k];
    known.settled = known.trust == Trust::kOpen;
    const double r = residual_of(known.edge, start_of(known.edge.from), start_of(known.edge.to));
    if (known.settled) known.weight = known.candidate = r <= verdict_.barc ? 1.0 : 0.0;
  }
}

void TreeNewton::unsettle() {
  for (Known& k : known_) {
    k.settled = false;
    k.weight = k.candidate = 1.0;
  }
}

// The own poses by odometry alone, from the first one. Unknown steps are those of the start.
std::vector<SE3> TreeNewton::odometry_poses() const {
  const std::vector<SE3>& start = graph_.start;
  std::vector<SE3> poses{start.front()};
  for (std::size_t k = 0; k < graph_.odometry; ++k) {
    const PoseEdge& step = known_[k].edge;
    poses.push_back(poses.back() *
                    (is_unknown_step(step) ? start[k].inverse() * start[k + 1] : step.T_from_to));
  }
  return poses;
}

// The poses of the ends of closures to `peer`, for cycles. Poses that were optimised with closures
// hide errors of cycles, so closures inside this robot are compared with its odometry. For closures
// to another robot, both robots use the starts of public poses, because they know nothing else of
// each other.
std::function<SE3(const KeyframeId&)> TreeNewton::pose_before_closures(
    RobotId peer, const std::vector<SE3>& odometry) const {
  if (peer == graph_.self)
    return [&odometry](const KeyframeId& id) { return odometry.at(id.index); };
  return [this](const KeyframeId& id) { return start_of(id); };
}

// The higher robot of a datum tie has it among its own edges.
void TreeNewton::share_closures(std::map<KeyframeIndex, std::uint32_t>& touched_by) {
  std::map<RobotId, std::set<KeyframeIndex>> touched_from;
  for (const PoseEdge& tie : graph_.datum_ties)
    if (tie.from.robot == graph_.self) touched_from[tie.to.robot].insert(tie.from.index);
  for (const auto& [peer, indices] : by_peer()) {
    if (peer == graph_.self) continue;
    std::vector<ClosureId> ids;
    for (const std::size_t k : indices)
      if (takes_part(known_[k])) ids.push_back(known_[k].edge.id());
    std::vector<KeyframeId> cover = cover_closures(ids);
    const bool is_child = std::ranges::binary_search(place_.children, peer);
    if (is_child || place_.parent == peer)
      cover = ends_if_few(ids, is_child ? peer : graph_.self, std::move(cover));
    const auto covered = [&](const KeyframeId& id) {
      return std::binary_search(cover.begin(), cover.end(), id);
    };
    std::set<KeyframeIndex>& theirs = touched_from[peer];
    for (const std::size_t k : indices) {
      Known& known = known_[k];
      const KeyframeId& here = known.edge.end_on(graph_.self);
      if (!takes_part(known)) continue;
      const bool both = covered(here) && covered(known.edge.other(graph_.self));
      known.own = both ? graph_.self < peer : !covered(here);
      if (!known.own) theirs.insert(here.index);
    }
  }
  for (const auto& [peer, theirs] : touched_from)
    for (const KeyframeIndex index : theirs) {
      auto& robots = touched_by.try_emplace(index, 1).first->second;
      ++robots;
    }
}

void TreeNewton::build_front() {
  const std::map<RobotId, double> limits = limits_of_pairs();
  FrontGraph front{.self = graph_.self,
                   .poses = static_cast<Index>(graph_.start.size()),
                   .dimension = options_.dimension,
                   .verticals = graph_.verticals,
                   .root = !place_.parent.has_value(),
                   .free = verdict_.free};
  if (options_.covariances) front.origin = graph_.origin;
  share_closures(front.touched_by);
  front_edge_.clear();
  for (std::size_t k = 0; k < known_.size(); ++k) {
    if (!takes_part(known_[k]) || !known_[k].own) continue;
    front.edges.push_back(known_[k].edge);
    front_edge_.push_back(k);
    if (k >= inside_) known_[k].pair_limit = known_[k].pair_factor = limits.at(peer_of(known_[k]));
  }
  front.edges.insert(front.edges.end(), graph_.fixes.begin(), graph_.fixes.end());
  for (const PoseEdge& tie : graph_.datum_ties) {
    front.open.insert(tie.end_on(graph_.self).index);
    if (tie.to.robot == graph_.self) front.edges.push_back(tie);
  }
  for (const PoseEdge& e : graph_.to_absent) {
    const auto decided = graph_.decided.find(e.id());
    const bool rejected = decided != graph_.decided.end() && !decided->second;
    if (rejected && options_.robust) continue;
    front.edges.push_back(e);
    front.held[e.other(graph_.self)] = start_of(e.other(graph_.self));
  }
  for (const PoseEdge& e : graph_.between) front.open.insert(e.end_on(graph_.self).index);
  front_.emplace(std::move(front));
  return_to_start();
  present_ = base_;
  refresh_ = true;
}

void TreeNewton::return_to_start() {
  accepted_ = graph_.start;
  base_.clear();
  for (std::size_t v = 0; v < front_->followed(); ++v) base_.push_back(start_of(front_->id(v)));
}

std::vector<double> TreeNewton::front_weights(bool candidate) const {
  std::vector<double> weights;
  for (const std::size_t k : front_edge_) {
    const Known& known = known_[k];
    const double weight = candidate ? known.candidate * known.candidate_pair_factor
                                    : known.weight * known.pair_factor;
    weights.push_back(known.trust == Trust::kOpen ? std::max(weight, kFloor) : weight);
  }
  weights.resize(front_->graph().edges.size(), 1.0);  // fixes, datum ties, edges to held poses
  return weights;
}

void TreeNewton::count_closures(TreeSums& sums) const {
  std::map<RobotId, PairVote> votes;
  for (const Known& k : known_) {
    if (!reports(k)) continue;
    if (k.deferred) ++sums.isolated;
    if (!takes_part(k)) continue;
    if (k.trust == Trust::kOpen && !k.settled) {
      ++sums.open;
      sums.largest = std::max(
          sums.largest,
          static_cast<float>(residual_of(k.edge, start_of(k.edge.from), start_of(k.edge.to))));
    }
    const RobotId peer = std::max(k.edge.from.robot, k.edge.to.robot);
    if (peer != graph_.self)
      ++votes.try_emplace(peer, PairVote{graph_.self, peer}).first->second.used;
  }
  const Corroboration::PoseOf pose = [this](const KeyframeId& id) { return start_of(id); };
  for (const auto& [peer, indices] : by_peer()) {
    const auto vote = votes.find(peer);
    if (vote == votes.end()) continue;
    std::vector<PoseEdge> closures;
    for (const std::size_t k : indices)
      if (takes_part(known_[k])) closures.push_back(known_[k].edge);
    if (const auto motion = motion_of_pair(closures, graph_.self, pose))
      vote->second.motion = *motion;
    const auto has_runs = [this](RobotId robot) {  // their unknown steps are no noise
      const auto runs = graph_.later_runs.find(robot);
      return runs != graph_.later_runs.end() && !runs->second.empty();
    };
    const bool whole = !has_runs(graph_.self) && !has_runs(peer);
    if (options_.robust && round_ == 0 && !graph_.again && whole)
      vote->second.odometry =
          odometry_evidence(closures, pose, graph_.step_precision, options_.dimension);
    const auto cycles = graph_.noise.pairs.find(peer);
    if (noise_known_ && cycles != graph_.noise.pairs.end() && shows_noise(cycles->second))
      vote->second.noise = static_cast<float>(cycles->second.factor);
    sums.votes.push_back(vote->second);
  }
}

// Public poses are sent in single precision. After the motion they are rounded again, so that all
// robots have equal values.
void TreeNewton::move_robots(const std::vector<std::pair<RobotId, SinglePose>>& moves) {
  std::set<KeyframeIndex> ends{0};
  for (const PoseEdge& e : graph_.between) ends.insert(e.end_on(graph_.self).index);
  for (const auto& [robot, move] : moves) {
    const SE3 T = move.pose();
    for (auto& [id, pose] : graph_.public_poses)
      if (id.robot == robot) pose = SinglePose::of(T * pose).pose();
    if (robot != graph_.self) continue;
    for (SE3& pose : graph_.start) pose = T * pose;
    for (const KeyframeIndex k : ends) graph_.start[k] = SinglePose::of(graph_.start[k]).pose();
    accepted_ = graph_.start;
  }
}

// All members know the mean steps of all, so all weaken them equally.
void TreeNewton::weaken_odometry() {
  for (const auto& [robot, factor] : graph_.noise.odometry) {
    const auto weaker = [&, f2 = factor * factor](Precision& p) {
      p.kappa /= f2;
      p.tau /= f2;
    };
    if (const auto step = graph_.step_precision.find(robot); step != graph_.step_precision.end())
      weaker(step->second);
    if (robot != graph_.self) continue;
    state_.odometry_noise = factor;
    for (std::size_t k = 0; k < graph_.odometry; ++k) weaker(known_[k].edge.precision);
  }
}

UpMessage TreeNewton::first_message() {
  UpMessage message{.round = round_, .sums = {}};
  TreeSums& sums = message.sums;
  sums.poses = static_cast<std::uint32_t>(graph_.start.size());
  sums.fixed = static_cast<std::uint32_t>(graph_.to_absent.size());
  count_closures(sums);
  const bool counts_again = !verdict_.odometry.empty();
  if (!options_.robust || (round_ > 0 && !counts_again)) return message;
  if (counts_again) graph_.noise.lengths.clear();
  sums.lengths = graph_.noise.lengths;
  if (graph_.again) return message;
  const std::size_t most =
      place_.members.size() < kEnoughToOutvote ? kEnoughLengths : kShareOfLengths;
  const std::vector<SE3> odometry = odometry_poses();
  for (const auto& [peer, indices] : by_peer()) {
    const Corroboration::PoseOf pose = pose_before_closures(peer, odometry);
    std::vector<PoseEdge> closures;
    for (const std::size_t k : indices)
      if (known_[k].trust == Trust::kOpen && reports(known_[k])) closures.push_back(known_[k].edge);
    Corroboration(closures, pose, graph_.step_precision, options_.dimension, graph_.later_runs)
        .count_lengths(graph_.noise.lengths, most);
  }
  sums.lengths = graph_.noise.lengths;
  return message;
}

const SE3& TreeNewton::pose_at(const KeyframeId& id, const std::vector<SE3>& poses) const {
  return poses[front_->node_of(id)];
}

UpMessage TreeNewton::equations() {
  UpMessage message{.round = round_, .sums = {}};
  const bool decided = verdict_.weighing == Weighing::kDecided;
  front_->weigh(front_weights(false), decided);
  message.sums.base_cost = front_->cost(base_);
  message.sums.cost = front_->cost(present_);
  weigh_candidates(message.sums);
  front_->weigh(front_weights(true), decided);
  if (refresh_ || front_->stale())
    front_->linearise(present_, verdict_.full ? Curvature::kFull : Curvature::kGaussNewton);
  refresh_ = false;
  std::map<RobotId, VectorXd> reduced;
  for (auto& [child, up] : ups_) reduced[child] = std::move(up.reduced);
  if (front_->changed()) {
    bool positive = front_->factorise();
    if (!positive && verdict_.full && place_.parent) {
      front_->linearise(present_, Curvature::kGaussNewton);
      positive = front_->factorise();
    }
    if (!positive && (place_.parent || !verdict_.full)) positive = front_->factorise_damped();
    factorised_ = positive;
    message.failed = !positive && place_.parent.has_value();
    if (positive && place_.parent) message.system = front_->system_for_parent(present_);
  } else {
    message.weights = front_->changed_weights();
  }
  if (!factorised_) return message;
  front_->reduce(present_, reduced);
  message.reduced = front_->reduced();
  message.sums.decrement = front_->decrement();
  message.failed = !message.reduced.allFinite() || !std::isfinite(message.sums.decrement);
  return message;
}

bool TreeNewton::receive(RobotId from, std::span<const std::uint8_t> bytes) {
  if (done()) return true;
  if (is_up_message(bytes)) {
    const bool child = std::binary_search(place_.children.begin(), place_.children.end(), from);
    auto message = child ? decode_up(bytes) : std::nullopt;
    if (!message) return false;
    if (message->round > round_)
      return false;  // impossible: the child waits for the message down of this round
    if (message->round == round_ && phase_ == Phase::kUp)
      ups_.try_emplace(from, std::move(*message));
    return true;
  }
  if (place_.parent != from) return false;
  auto message = decode_down(bytes);
  if (!message) return false;
  if (message->verdict.round < round_) return true;
  if (message->verdict.round > round_ || phase_ != Phase::kDown || !can_follow(*message))
    return false;
  if (!down_) down_ = std::move(*message);
  return true;
}

// True if the decision of the root fits the last message up of this robot.
bool TreeNewton::can_follow(const DownMessage& message) const {
  switch (message.verdict.next) {
    case Next::kCount:
    case Next::kStart:
      return !front_;
    case Next::kStep:
      return front_ && message.step.size() == sent_rows_;
    case Next::kShorten:
      return front_ && step_.size() > 0;
    case Next::kRefresh:
    case Next::kDone:
      return front_.has_value();
    case Next::kStop:
      break;
  }
  return true;
}

bool TreeNewton::ready() const {
  if (done()) return false;
  if (phase_ == Phase::kDown) return down_.has_value();
  return ups_.size() == place_.children.size();
}

std::vector<SolverMessage> TreeNewton::advance() {
  if (!ready()) return {};
  if (phase_ == Phase::kUp) return go_up();
  const DownMessage message = std::move(*down_);
  down_.reset();
  return go_down(message);
}

std::vector<SolverMessage> TreeNewton::go_up() {
  UpMessage message;
  bool failed =
      std::any_of(ups_.begin(), ups_.end(), [](const auto& up) { return up.second.failed; });
  if (!failed) {
    try {
      for (auto& [child, up] : ups_) {
        if (up.system) front_->set_child(child, std::move(*up.system));
        if (front_) front_->reweigh_child(child, up.weights);
      }
      message = front_ ? equations() : first_message();
    } catch (const std::exception&) {
      failed = true;  // the message of a child does not fit
    }
  }
  for (const auto& [child, up] : ups_) message.sums.add(up.sums);
  message.round = round_;
  message.failed = message.failed || failed;
  ups_.clear();
  sent_rows_ = message.failed ? -1 : message.reduced.size();
  if (place_.parent) {
    phase_ = Phase::kDown;
    return {message_to(*place_.parent, encode(message))};
  }
  // Full second derivatives may become indefinite when those of several robots are added.
  if (message.failed && verdict_.full) return go_down(root_->retreat(round_));
  state_.failed = message.failed;
  if (message.failed) return go_down(root_->stop(round_));
  if (!front_) return go_down(root_->decide_start(message.sums, round_));
  const DownMessage decision = root_->decide(message.sums, round_, *front_, present_, factorised_);
  state_.failed = decision.verdict.next == Next::kStop && !factorised_;
  return go_down(decision);
}

void TreeNewton::accept() {
  base_ = present_;
  accepted_.assign(base_.begin(), base_.begin() + static_cast<Index>(accepted_.size()));
  for (Known& k : known_) {
    k.weight = k.candidate;
    k.pair_factor = k.candidate_pair_factor;
  }
}

void TreeNewton::take_step(const VectorXd& step, const TreeVerdict& verdict,
                           std::map<RobotId, VectorXd>& children) {
  // The robots of one pose move it by one step, to the last bit.
  const MatrixXd steps = in_single_precision(front_->substitute_back(step));
  for (const RobotId child : place_.children) children[child] = front_->step_of_child(child, steps);
  step_ = steps.leftCols(static_cast<Index>(front_->followed()));
  const Eigen::Map<const Eigen::Vector3d> w(verdict.drift.data());
  const Eigen::Map<const Eigen::Vector3d> u(verdict.drift.data() + 3);
  const Index first = step_.rows() == 3 ? 2 : 0;
  for (std::size_t v = 0; v < base_.size(); ++v) {
    const Eigen::Matrix3d R_t = base_[v].linear().transpose();
    Vector6 xi;
    xi << R_t * w, R_t * (w.cross(base_[v].translation()) + u);
    step_.col(static_cast<Index>(v)) += xi.segment(first, step_.rows());
  }
}

std::vector<SolverMessage> TreeNewton::go_down(const DownMessage& message) {
  const TreeVerdict& v = message.verdict;
  std::map<RobotId, VectorXd> step_of_child;
  const auto move = [&](double scale) {
    for (std::size_t k = 0; k < base_.size(); ++k) {
      const SE3 moved =
          retract(base_[k], scale * tangent_of_step(step_.col(static_cast<Index>(k))));
      // The step of a robot whose equations are singular to rounding may be arbitrarily long.
      present_[k] = is_within_limits(moved) ? moved : base_[k];
    }
  };
  verdict_ = v;
  if (v.weigh_all) unsettle();
  if (!v.odometry.empty()) {
    graph_.noise.odometry = v.odometry;
    weaken_odometry();
  } else if (!front_) {
    weigh_by_noise();
    move_robots(v.moves);
  }
  switch (v.next) {
    case Next::kCount:
      if (!v.odometry.empty()) break;
      settle();
      if (v.deferred) find_isolated(default_threshold(options_.dimension) * v.noise_scale);
      break;
    case Next::kStart:
      weigh_by_usual_noise();
      if (!v.deferred)
        for (Known& k : known_) k.deferred = false;
      build_front();
      break;
    case Next::kStep:
      accept();
      take_step(message.step, v, step_of_child);
      move(v.scale);
      break;
    case Next::kShorten:
      move(v.scale);
      break;
    case Next::kRefresh:
      if (v.accept) accept();
      if (v.weigh_all) return_to_start();
      present_ = base_;
      refresh_ = true;
      break;
    case Next::kDone:
      accept();
      compute_covariances(message.inverse);
      finish();
      break;
    case Next::kStop:
      finish();
      break;
  }
  const bool deferred = state_.deferred || (v.next == Next::kStart && v.deferred);
  state_ = {.round = round_ + 1,
            .cost = v.cost,
            .gradient = v.gradient,
            .noise_scale = v.noise_scale,
            .odometry_noise = state_.odometry_noise,
            .barc = options_.robust ? v.barc : 0.0,
            .deferred = deferred,
            .failed = state_.failed};
  if (!done()) phase_ = Phase::kUp;
  ++round_;
  std::vector<SolverMessage> messages;
  for (const RobotId child : place_.children) {
    const DownMessage down{v, step_of_child[child], std::move(inverse_of_child_[child])};
    messages.push_back(message_to(child, encode(down)));
  }
  return messages;
}

// The cost is chi-squared distributed, so the covariance is twice the inverse of its second
// derivatives. If closures are noisier than they claim, the covariance is larger.
void TreeNewton::compute_covariances(const TreeInverse& from_parent) {
  const bool known = factorised_ && !front_->damped() && !(place_.parent && from_parent.empty());
  if (!options_.covariances || !known) return;
  std::optional<BlockMatrix> solved;
  try {
    solved = place_.parent ? front_->inverse(front_->inverse_from_parent(from_parent))
                           : front_->inverse_about_origin(graph_.upright);
  } catch (const std::invalid_argument&) {
    return;  // the message of the parent does not fit, but the poses are final
  }
  if (!solved) return;
  const BlockMatrix& inverse = *solved;
  const Index B = front_->block(), first = B == 3 ? 2 : 0;
  const double scale = 2.0 * std::max(1.0, verdict_.noise_scale * verdict_.noise_scale);
  for (std::size_t k = 0; k < accepted_.size(); ++k) {
    covariances_.emplace_back(Matrix6::Zero());
    covariances_.back().block(first, first, B, B) = scale * inverse.at(static_cast<int>(k));
  }
  for (const RobotId child : place_.children)
    inverse_of_child_[child] = front_->inverse_of_child(child, inverse);
}

// Releases the factors, which take most of the memory of a robot; this object exists until the next
// session begins.
void TreeNewton::finish() {
  phase_ = Phase::kDone;
  front_.reset();
}

ClosureVerdicts TreeNewton::verdicts() const {
  ClosureVerdicts verdicts;
  if (!options_.robust || verdict_.weighing != Weighing::kDecided) return verdicts;
  for (const Known& k : known_) {
    if (k.odometry) continue;
    const bool reported = takes_part(k) ? k.own : reports(k);
    if (reported) verdicts.closures.push_back({k.edge.id(), takes_part(k) && k.weight > 0.5});
  }
  return verdicts;
}

}  // namespace km
