#include "modules/robust/tree_newton.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Next = TreeVerdict::Next;

// Largest distance of a pose from the origin; beyond it, single precision overflows.
constexpr double kMaxDistance_m = 1e15;
constexpr double kLongestStep = 1e30;

bool is_within_limits(const SE3& T) {
  return T.matrix().allFinite() && T.translation().norm() <= kMaxDistance_m;
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

bool has_noisy_odometry(const SessionGraph& graph) {
  return std::ranges::any_of(graph.odometry_precision, [](const auto& of_robot) {
    return std::min(of_robot.second.kappa, of_robot.second.tau) < 1.0;
  });
}

}  // namespace

TreeNewton::TreeNewton(SessionGraph graph, TreePlace place, const TreeNewtonOptions& options)
    : options_(options),
      place_(std::move(place)),
      edges_(std::move(graph), place_, options),
      accepted_(edges_.graph().start) {
  if (!place_.parent)
    root_.emplace(place_.members, options_, edges_.graph().upright, edges_.graph().again,
                  has_noisy_odometry(edges_.graph()));
}

void TreeNewton::build_front() {
  front_.emplace(edges_.front_graph(verdict_.free));
  weights_.emplace(edges_.weights(verdict_.usual_pair));
  return_to_start();
  present_ = base_;
  refresh_ = true;
}

void TreeNewton::return_to_start() {
  accepted_ = edges_.graph().start;
  base_.clear();
  for (const KeyframeId& id : front_->followed()) base_.push_back(edges_.start_of(id));
}

UpMessage TreeNewton::equations() {
  UpMessage message;
  const bool decided = verdict_.weighing == TreeVerdict::Weighing::kDecided;
  FrontEdges& own = front_->own();
  own.weigh(weights_->in_equations(false), decided);
  message.sums.base_cost = own.cost(base_);
  message.sums.cost = own.cost(present_);
  weights_->weigh(verdict_, own, present_, message.sums);
  if (decided && options_.robust && !edges_.graph().again)
    message.sums.left = edges_.count_possible(*weights_, own, present_, verdict_.barc);
  own.weigh(weights_->in_equations(true), decided);
  if (refresh_ || own.stale())
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
    if (!positive && (place_.parent || !verdict_.full)) positive = front_->factorise(true);
    factorised_ = positive;
    message.failed = !positive && place_.parent.has_value();
    if (positive && place_.parent) message.system = front_->system_for_parent(present_);
  } else {
    message.weights = front_->changed_weights();
  }
  if (!factorised_) return message;
  TreeFront::Reduced found = front_->reduce(present_, reduced);
  message.reduced = std::move(found.kept);
  message.sums.decrement = found.decrement;
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
      for (auto& [child, up] : ups_)
        if (front_) front_->update_child(child, std::move(up.system), up.weights);
      message = front_ ? equations() : UpMessage{.sums = edges_.count()};
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
  accepted_.assign(base_.begin(), base_.begin() + std::ssize(accepted_));
  weights_->accept();
}

void TreeNewton::take_step(const VectorXd& step, std::map<RobotId, VectorXd>& children) {
  // The robots of one pose move it by one step, to the last bit.
  const MatrixXd steps = in_single_precision(front_->substitute_back(step));
  for (const RobotId child : place_.children) children[child] = front_->step_of_child(child, steps);
  step_ = steps.leftCols(std::ssize(base_));
  const Eigen::Map<const Eigen::Vector3d> w(verdict_.drift.data());
  const Eigen::Map<const Eigen::Vector3d> u(verdict_.drift.data() + 3);
  for (Index v = 0; v < std::ssize(base_); ++v) {
    const SE3& T = base_[at(v)];
    const Eigen::Matrix3d R_t = T.linear().transpose();
    Vector6 xi;
    xi << R_t * w, R_t * (w.cross(T.translation()) + u);
    step_.col(v) += xi.segment(first_row_of(step_.rows()), step_.rows());
  }
}

// The step of a robot whose equations are singular to rounding may be arbitrarily long.
void TreeNewton::move(double scale) {
  for (Index v = 0; v < std::ssize(base_); ++v) {
    const SE3 moved = retract(base_[at(v)], scale * tangent_of_step(step_.col(v)));
    present_[at(v)] = is_within_limits(moved) ? moved : base_[at(v)];
  }
}

std::vector<SolverMessage> TreeNewton::go_down(const DownMessage& message) {
  const TreeVerdict& v = message.verdict;
  std::map<RobotId, VectorXd> step_of_child;
  verdict_ = v;
  if (!front_) {
    edges_.follow(v);
    accepted_ = edges_.graph().start;
  } else if (v.weigh_all) {
    weights_->unsettle();
  }
  switch (v.next) {
    case Next::kCount:
      break;
    case Next::kStart:
      build_front();
      break;
    case Next::kStep:
      accept();
      if (v.doubt > 0.0) doubt(message.inverse);
      take_step(message.step, step_of_child);
      move(v.scale);
      break;
    case Next::kShorten:
      move(v.scale);
      break;
    case Next::kRefresh:
      if (v.accept) accept();
      if (v.weigh_all || v.restart) return_to_start();
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
  state_ = {.round = ++round_,
            .cost = v.cost,
            .gradient = v.gradient,
            .noise_scale = v.noise_scale,
            .odometry_noise = edges_.odometry_noise(),
            .barc = options_.robust ? v.barc : 0.0,
            .deferred = v.next == Next::kDone && v.deferred,
            .failed = state_.failed};
  if (!done()) phase_ = Phase::kUp;
  std::vector<SolverMessage> messages;
  for (const RobotId child : place_.children) {
    const DownMessage down{v, step_of_child[child], std::move(inverse_of_child_[child])};
    messages.push_back(message_to(child, encode(down)));
  }
  return messages;
}

void TreeNewton::doubt(const TreeInverse& from_parent) {
  if (!factorised_ || front_->damped() || (place_.parent && from_parent.diagonal.empty())) return;
  const std::optional<BlockMatrix> inverse =
      place_.parent ? front_->inverse(from_parent)
                    : front_->inverse_about_held(edges_.graph().upright);
  if (!inverse) return;
  weights_->doubt(verdict_, front_->own(), base_, *inverse);
  for (const RobotId child : place_.children)
    inverse_of_child_[child] = front_->inverse_of_child(child, *inverse, true);
}

// The cost is chi-squared distributed, so the covariance is twice the inverse of its second
// derivatives. If closures are noisier than they claim, the covariance is larger.
void TreeNewton::compute_covariances(const TreeInverse& from_parent) {
  const bool known =
      factorised_ && !front_->damped() && !(place_.parent && from_parent.diagonal.empty());
  if (!options_.covariances || !known || verdict_.deferred) return;
  // nullopt also if the message of the parent does not fit: the poses are final nevertheless.
  const std::optional<BlockMatrix> solved =
      place_.parent ? front_->inverse(from_parent)
                    : front_->inverse_about_origin(edges_.graph().upright);
  if (!solved) return;
  const Index B = solved->block(), first = first_row_of(B);
  const double scale = 2.0 * std::max(1.0, verdict_.noise_scale * verdict_.noise_scale);
  for (std::size_t k = 0; k < accepted_.size(); ++k) {
    covariances_.emplace_back(Matrix6::Zero());
    covariances_.back().block(first, first, B, B) = scale * solved->at(static_cast<int>(k));
  }
  for (const RobotId child : place_.children)
    inverse_of_child_[child] = front_->inverse_of_child(child, *solved);
}

// Releases the factors, which take most of the memory of a robot; this object exists until the next
// session begins.
void TreeNewton::finish() {
  phase_ = Phase::kDone;
  front_.reset();
}

ClosureVerdicts TreeNewton::verdicts() const {
  const bool decided = options_.robust && verdict_.weighing == TreeVerdict::Weighing::kDecided;
  return decided && weights_ ? edges_.verdicts(*weights_) : ClosureVerdicts{};
}

}  // namespace km
