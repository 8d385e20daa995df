#include "modules/robust/tree_root.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "modules/robust/noise_histogram.hpp"
#include "modules/robust/odometry_evidence.hpp"

namespace km {
namespace {

using Eigen::Index;
using Next = TreeVerdict::Next;
using Weighing = TreeVerdict::Weighing;

constexpr double kShorten = 0.25;
constexpr double kLengthen = 4.0;
// An increase of the cost is accepted if it is rounding: relative to the cost, and near 0.
constexpr double kCostRounding = 1e-13;
constexpr double kLeastRise = 1e-9;
// Rounding may keep steps from being shorter: each round below this predicted decrease relaxes the
// tolerances.
constexpr double kNearRounding = 1e-13;
constexpr double kRelax = 2.0;
constexpr int kMaxBacktracks = 12;
constexpr int kMaxBacktracksUndecided = 8;
// Margin on barc if noise is smaller than stated, because its tails are then longer: the largest
// residual of parking-garage is 31 times the scale.
constexpr double kMargin = 8.0;
// Share of consistent cycles from which on a closure that stands alone is probably false.
constexpr double kMostlyConsistent = 0.75;
constexpr std::uint32_t kFewOpen = 32;  // closures; so few false ones do no harm
// Closures per pose below which the deferred closures are needed from the start.
constexpr double kClosuresPerPose = 0.25;

// Share of closures inside robots below which these do not decide them alone, because the second
// derivatives change with the weights of the others anyway.
constexpr double kWorthDeciding = 0.1;
// From this many rejected closures between robots on, and this share of the open ones, closures
// inside robots are weighed as well.
constexpr std::uint32_t kLeastRejected = 2;
constexpr double kMostRejected = 0.03;

// The other edges contradict a pair if its closures all pull in one direction. Their mean error
// then exceeds kPullOfMean standard deviations of this mean, and kPullOfOne of a single closure.
constexpr double kPullOfMean = 6.0;
constexpr double kPullOfOne = 1.0;

// Closures are doubted if all noise is at most this many times the claimed one. Limits on residuals
// are then too wide for false closures, of which they let about one in a hundred pass. Two false
// ones may hide each other, so there are more doubts.
constexpr double kClaimsTooMuch = 0.5;
constexpr std::uint32_t kWorthDoubting = 100;  // rejected closures
constexpr int kMaxDoubts = 4;

// Predicted decrease of a step, relative to the cost: of poses for which mu waits, of nearly
// converged poses, and of poses from which a second look starts.
constexpr double kFar = 0.3;
constexpr double kNearlyConverged = 1e-8;
constexpr double kGoodStart = 1e-9;
// Largest ratio of the predicted decreases at two second derivatives that make progress.
constexpr double kProgress = 0.5;

constexpr std::size_t kEnoughPairs = 3;  // for the noise of the usual pair

// True if pairs with closures in use connect all robots.
bool joined(const std::vector<RobotId>& robots, const std::vector<PairVote>& votes) {
  std::map<RobotId, RobotId> part;
  for (const RobotId robot : robots) part[robot] = robot;
  for (const PairVote& v : votes) {
    if (v.used == 0 || !part.contains(v.a) || !part.contains(v.b)) continue;
    const RobotId gone = part[v.b];
    for (auto& [robot, name] : part)
      if (name == gone) name = part[v.a];
  }
  return std::all_of(part.begin(), part.end(),
                     [&](const auto& entry) { return entry.second == part.begin()->second; });
}

PairMotions motions_of(const std::vector<PairVote>& votes) {
  PairMotions pairs;
  for (const PairVote& v : votes)
    if (v.used > 0) pairs[{v.a, v.b}] = v.motion;
  return pairs;
}

// The noise that at least half of the pairs reach or exceed. Pairs without an estimate count as 1.
// With fewer than kEnoughPairs pairs, the result is 1.
double usual_pair_noise(const std::vector<PairVote>& votes) {
  if (votes.size() < kEnoughPairs) return 1.0;
  std::vector<float> noise;
  for (const PairVote& v : votes) noise.push_back(std::max(1.0F, v.noise));
  const auto middle = noise.begin() + static_cast<std::ptrdiff_t>((noise.size() - 1) / 2);
  std::ranges::nth_element(noise, middle);
  return static_cast<double>(*middle);
}

// The largest noise scale that a solution allows. `cost` is at least that of the kept closures.
// With closures s times noisier than stated, it is s^2 times a chi-squared variable of their
// cycles. The result is the upper end of the one-sided interval for s of 99 % (quantile by Wilson
// and Hilferty, PNAS 1931); infinity if there are no cycles.
double noise_allowed(double cost, std::uint32_t kept, std::size_t members, int dimension) {
  constexpr double kQuantile = -2.326;  // quantile of the normal distribution at 1 %
  const double cycles = static_cast<double>(kept) - static_cast<double>(members - 1);
  if (cycles < 1.0) return std::numeric_limits<double>::infinity();
  const double freedom = (dimension == 2 ? 3.0 : 6.0) * cycles;
  const double v = 2.0 / (9.0 * freedom);
  return std::sqrt(cost / (freedom * std::pow(1.0 - v + kQuantile * std::sqrt(v), 3.0)));
}

std::vector<std::pair<RobotId, SinglePose>> moves_of(const std::vector<PairVote>& votes) {
  std::vector<std::pair<RobotId, SinglePose>> moves;
  for (const auto& [robot, T] : common_placement(motions_of(votes)))
    moves.emplace_back(robot, SinglePose::of(T));
  return moves;
}

// Returns a rigid motion of all poses. Added to `steps`, it makes their mean rotation and mean
// translation zero. To first order, a rigid motion does not change the cost. The sum does not
// depend on which pose the root keeps constant. `upright`: the motion rotates about z only, because
// other rotations change the cost.
std::array<double, 6> drift_against(std::span<const SE3> poses, const Eigen::MatrixXd& steps,
                                    bool upright) {
  const double share = 1.0 / static_cast<double>(poses.size());
  const auto xi = [&](std::size_t v) { return tangent_of_step(steps.col(static_cast<Index>(v))); };
  Eigen::Vector3d w = Eigen::Vector3d::Zero(), u = Eigen::Vector3d::Zero();
  for (std::size_t v = 0; v < poses.size(); ++v) w -= share * (poses[v].linear() * xi(v).head<3>());
  if (upright) w.head<2>().setZero();
  for (std::size_t v = 0; v < poses.size(); ++v)
    u -= share * (poses[v].linear() * xi(v).tail<3>() + w.cross(poses[v].translation()));
  return {w.x(), w.y(), w.z(), u.x(), u.y(), u.z()};
}

}  // namespace

DownMessage TreeRoot::answer(Next next) const {
  DownMessage message;
  message.verdict = {.round = round_,
                     .next = next,
                     .full = full_,
                     .free = free_,
                     .weighing = weighing_,
                     .mu = schedule_.mu(),
                     .barc = barc_,
                     .noise_scale = noise_scale_,
                     .usual_noise = usual_noise_,
                     .usual_pair = usual_pair_,
                     .cost = cost_,
                     .gradient = std::sqrt(std::max(0.0, decrement_))};
  return message;
}

DownMessage TreeRoot::stop(std::uint32_t round) {
  round_ = round;
  return answer(Next::kStop);
}

DownMessage TreeRoot::retreat(std::uint32_t round) {
  round_ = round;
  convex_ = true;
  return refresh(false, weighing_);
}

DownMessage TreeRoot::decide_start(const TreeSums& sums, std::uint32_t round) {
  round_ = round;
  if (first_) {
    first_->largest = sums.largest_of_all;  // after the robots have moved
    const double all = first_->open, near = all - sums.left;
    alone_ = alone_ && near - sums.open >= kWorthDeciding * all;
    if (!may_defer_) return start(false, alone_ ? sums : *first_);
    usual_noise_ = usual_pair_noise(sums.votes);
    const bool enough = near >= kClosuresPerPose * sums.poses;
    const bool deferred = sums.left > kFewOpen && enough && joined(members_, sums.votes);
    return start(deferred, deferred ? sums : *first_);
  }
  if (!weakened_ && options_.robust && !again_) {
    const auto noise = likely_odometry_noise(sums.votes);
    if (!noise.empty()) {
      noisy_ = weakened_ = true;
      DownMessage message = answer(Next::kCount);
      message.verdict.odometry.assign(noise.begin(), noise.end());
      return message;
    }
  }
  first_ = sums;
  free_ = sums.fixed == 0;
  const std::optional<NoiseScale> noise = fit_noise(sums.lengths, options_.dimension);
  if (noise) noise_scale_ = noise->scale;
  const double margin = noise_scale_ < 1.0 ? std::min(1.0, kMargin * noise_scale_) : noise_scale_;
  barc_ = options_.barc > 0.0 ? options_.barc : margin * default_threshold(options_.dimension);
  may_defer_ = !again_ && noise && noise->consistent >= kMostlyConsistent && sums.open > kFewOpen;
  alone_ = options_.robust && members_.size() > 1 && sums.open > 0;
  DownMessage message = may_defer_ || alone_ ? answer(Next::kCount) : start(false, sums);
  if (message.verdict.next == Next::kCount) message.verdict.deferred = may_defer_;
  if (options_.robust && free_ && !again_ && sums.open > 0)
    message.verdict.moves = moves_of(sums.votes);
  return message;
}

DownMessage TreeRoot::start(bool deferred, const TreeSums& sums) {
  schedule_.start(sums.largest, options_.robust ? sums.open : 0, barc_);
  if (options_.robust) usual_pair_ = usual_strength(motions_of(sums.votes));
  weighing_ = schedule_.decided() ? Weighing::kDecided : Weighing::kWeigh;
  deferred_ = deferred;
  DownMessage message = answer(Next::kStart);
  message.verdict.deferred = deferred;
  message.verdict.weigh_all = !alone_;
  return message;
}

DownMessage TreeRoot::decide(const TreeSums& sums, std::uint32_t round, const TreeFront& front,
                             std::span<const SE3> poses, bool factorised) {
  round_ = round;
  if (sums.doubted > 0) {
    may_doubt_ = true;
    backtracks_ = 0;
    DownMessage message = refresh(false, weighing_);
    message.verdict.restart = true;
    return message;
  }
  const double limit = sums.base_cost * (1.0 + kCostRounding) + kLeastRise;
  if (!at_base_ && !(sums.cost <= limit)) return go_back();
  if (!at_base_) {
    retried_ = false;
    stale_ = true;
    // While weights change, a step length that is much too long now will be too long in the next
    // round.
    length_ = std::min(1.0, backtracks_ > 0 ? length_ : kLengthen * length_);
    backtracks_ = 0;
  }
  cost_ = sums.cost;
  if (!factorised) {
    if (!full_) return answer(Next::kStop);
    convex_ = true;
    return refresh(true, weighing_);
  }
  return step(sums, front, poses);
}

DownMessage TreeRoot::step(const TreeSums& sums, const TreeFront& front,
                           std::span<const SE3> poses) {
  const TreeFront::Reduced root = front.solve_root(upright_);
  decrement_ = sums.decrement + root.decrement;
  // If odometry is noisy, the poses may be far from the minimum of the nearly convex cost at the
  // beginning. A large predicted decrease shows that the quadratic model does not hold there; mu
  // then waits for another step.
  const bool far =
      noisy_ && !at_base_ && schedule_.is_nearly_convex() && 0.5 * decrement_ > kFar * cost_;
  if (!far && weighing_ != Weighing::kHold) schedule_.next({sums.changed, sums.fractional});
  if (decrement_ <= kNearRounding * (1.0 + cost_))
    for (double* limit : {&options_.tolerance, &options_.absolute_tolerance}) *limit *= kRelax;
  const bool looks_again = deferred_ || (!again_ && sums.left > 0);
  const double tolerance =
      looks_again ? std::max(kGoodStart, options_.tolerance) : options_.tolerance;
  const bool small = 0.5 * decrement_ <= tolerance * cost_ + options_.absolute_tolerance;
  // Weights are decided before the poses have converged. If the converged poses contradict them,
  // closures are weighed again. A second look mostly rejects closures that it has reopened.
  const bool contradicts = alone_ && !again_ && sums.rejected >= kLeastRejected &&
                           sums.rejected > kMostRejected * static_cast<double>(sums.open);
  if (schedule_.decided() && contradicts) return weigh_all();
  if (schedule_.decided() && small && sums.changed > 0 && schedule_.reopen()) {
    last_decrement_.reset();
    released_ = false;
  }
  // Pairs are released from their limits only once the poses have nearly converged, because before
  // even consistent pairs show a pull.
  const bool nearly = 0.5 * decrement_ <= kNearlyConverged * cost_ + options_.absolute_tolerance;
  const bool decided = schedule_.decided();
  const bool shows_pulls = weighing_ == Weighing::kDecided;
  weighing_ = decided ? Weighing::kDecided : Weighing::kWeigh;
  if (decided && nearly && shows_pulls && !std::exchange(released_, true)) {
    if (auto pairs = consistent_pairs(sums.pulls); !pairs.empty()) {
      full_ = false;  // the poses are no longer near the minimum
      DownMessage message = refresh(true, weighing_);
      message.verdict.released = std::move(pairs);
      return message;
    }
  }
  const bool unlimited = released_ || usual_pair_.tau >= kUnlimited.tau;
  const double allowed = noise_allowed(cost_, sums.kept, members_.size(), options_.dimension);
  const bool doubts = may_doubt_ && options_.robust && sums.dropped >= kWorthDoubting && decided &&
                      shows_pulls && nearly && unlimited && allowed < kClaimsTooMuch &&
                      doubts_ < kMaxDoubts;
  if ((decided && small && unlimited && !doubts) || round_ + 1 >= options_.max_rounds) {
    // False closures that agree roughly with each other look like noisy ones at first, and are
    // rejected later.
    if (allowed < noise_scale_) noise_scale_ = std::min(noise_scale_, std::max(1.0, allowed));
    DownMessage message = answer(Next::kDone);
    message.verdict.deferred = looks_again;
    return message;
  }
  // Full second derivatives may hold a closure less than its own precision does.
  if (doubts && (full_ || stale_)) {
    full_ = false;
    return refresh(true, weighing_);
  }
  if (decided && !doubts && worth_refreshing(decrement_)) {
    // Couplings are rounded when they are sent. If steps have not become shorter since the last
    // full ones, soft motions of the team are rounded away; those of Gauss-Newton round
    // differently.
    full_ = !full_ || !nearly || decrement_ < kProgress * refreshed_decrement_;
    refreshed_decrement_ = decrement_;
    convex_ = false;
    return refresh(true, weighing_);
  }
  at_base_ = false;
  if (decided) length_ = 1.0;
  DownMessage message = answer(Next::kStep);
  message.verdict.scale = length_;
  message.step = root.kept;
  if (doubts) {
    message.verdict.doubt = allowed;
    may_doubt_ = false;
    ++doubts_;
  }
  if (free_)
    message.verdict.drift = drift_against(
        poses, front.substitute_back(root.kept).leftCols(static_cast<Index>(poses.size())),
        upright_);
  return message;
}

// Closures between robots cannot bend a robot as far if those inside it have their full weight from
// the start. If some are rejected, this may be why. All are then weighed together, from the start.
DownMessage TreeRoot::weigh_all() {
  alone_ = released_ = false;
  schedule_.start(first_->largest, first_->open, barc_);
  backtracks_ = 0;
  DownMessage message = refresh(false, Weighing::kWeigh);
  message.verdict.weigh_all = true;
  return message;
}

std::vector<std::pair<RobotId, RobotId>> TreeRoot::consistent_pairs(
    std::span<const PairPull> pulls) const {
  std::vector<std::pair<RobotId, RobotId>> pairs;
  for (const PairPull& pull : pulls) {
    const double most = std::max(kPullOfMean, kPullOfOne * std::sqrt(pull.closures));
    if (!(pull.sum.norm() > most * noise_scale_ * std::sqrt(pull.weight)))
      pairs.emplace_back(pull.a, pull.b);
  }
  return pairs;
}

DownMessage TreeRoot::go_back() {
  ++backtracks_;
  const bool decided = weighing_ == Weighing::kDecided;
  if (backtracks_ > (decided ? kMaxBacktracks : kMaxBacktracksUndecided)) {
    if (decided) return answer(Next::kStop);
    retried_ = false;
    return refresh(false, weighing_);  // with the next weights, the next step may succeed
  }
  if (decided && stale_) {
    full_ = !convex_;
    return refresh(false, weighing_);
  }
  if (!decided && backtracks_ == 2 && !retried_) {
    retried_ = true;
    return refresh(false, Weighing::kHold);
  }
  DownMessage message = answer(Next::kShorten);
  message.verdict.scale = length_ *= kShorten;
  return message;
}

DownMessage TreeRoot::refresh(bool accept, Weighing weighing) {
  if (convex_) full_ = false;
  weighing_ = weighing;
  at_base_ = true;
  stale_ = false;
  length_ = 1.0;
  last_decrement_.reset();
  DownMessage message = answer(Next::kRefresh);
  message.verdict.accept = accept;
  return message;
}

bool TreeRoot::worth_refreshing(double decrement) {
  const std::optional<double> before = std::exchange(last_decrement_, decrement);
  if (!before) return false;
  const double rate = decrement / *before;
  if (!(rate < 1.0)) return true;
  const double enough = 2.0 * (options_.tolerance * cost_ + options_.absolute_tolerance);
  return std::log(decrement / enough) / -std::log(rate) > options_.patience_rounds;
}

}  // namespace km
