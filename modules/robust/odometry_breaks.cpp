#include "modules/robust/odometry_breaks.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "modules/core/geometry/lie.hpp"
#include "modules/outlier_rejection/chi_squared.hpp"
#include "modules/robust/closure_places.hpp"
#include "modules/robust/odometry_cycles.hpp"

namespace km {
namespace {

// Share of the cycles without false closures that are consistent at the claimed noise.
constexpr double kConsistent = 0.999;
// Least number of places that show a jump. Two are too few: false closures between the same two
// similar parts of the environment count as two places if they are more than ten keyframes apart.
constexpr double kLeastPlaces = 3.0;
// Factor on the limit, up to which a cycle that contains the step counts as consistent. The largest
// errors of noisy odometry are near the limit: with a factor of 1, one of 360 random trajectories
// without a wrong step had a break.
constexpr double kConsistentMargin = 2.0;
// Share of the cycles with a wrong step that may be consistent: long cycles do not show a jump.
constexpr double kMostConsistent = 0.1;
constexpr std::size_t kMostErrorCycles = 200;  // bounds the time
constexpr std::size_t kMostBreaks = 5;         // odometry with more of them is noisy
// Largest speed in a correct step, relative to the speed that 95 % of the steps of the robot do not
// exceed. The robot moves in a wrong step as in the others. Rows of closures between parts of the
// environment that look alike agree on a jump, too, but this jump has any length.
constexpr double kUsualShare = 0.95;
constexpr double kFastestStep = 3.0;

struct ErrorCycle {
  std::size_t lower = 0;  // keyframes at its ends
  std::size_t upper = 0;
  Vector6 error;
  Matrix6 Sigma;
  double squared = 0.0;  // squared Mahalanobis length of the error
  double weight = 1.0;   // such that each place counts once
  [[nodiscard]] bool contains(std::size_t step) const { return lower <= step && step < upper; }
};

// A jump after a step that would close one cycle, in the frame of the next keyframe.
struct Jump {
  SE3 T;
  Matrix6 Sigma;
  double weight = 1.0;
};

double places_of(const std::vector<Jump>& jumps) {
  double sum = 0.0;
  for (const Jump& jump : jumps) sum += jump.weight;
  return sum;
}

std::vector<ErrorCycle> error_cycles(const OdometryChain& chain, std::span<const PoseEdge> closures,
                                     int dimension) {
  std::vector<PoseEdge> inside;
  for (const PoseEdge& e : closures)
    if (std::max(e.from.index, e.to.index) < chain.T_first_kf.size() &&
        chain.joins(e.from.index, e.to.index))
      inside.push_back(e);
  std::ranges::sort(inside, {}, &PoseEdge::id);
  const std::vector<double> weights = find_places(inside).weights();
  const std::size_t stride = (inside.size() + kMostErrorCycles - 1) / kMostErrorCycles;
  std::vector<ErrorCycle> cycles;
  for (std::size_t k = 0; k < inside.size(); k += stride) {
    const OdometryCycle cycle = chain.close(inside[k]);
    const Matrix6 Sigma = cycle.claimed();
    cycles.push_back({cycle.lower, cycle.upper, cycle.error, Sigma,
                      mahalanobis_length(cycle.error, Sigma, dimension).squared,
                      static_cast<double>(stride) * weights[k]});
  }
  return cycles;
}

// Runs of steps [first, second) that are in the same cycles.
std::vector<std::pair<std::size_t, std::size_t>> runs_of_steps(
    const std::vector<ErrorCycle>& cycles, std::size_t steps) {
  std::set<std::size_t> ends{0, steps};
  for (const ErrorCycle& cycle : cycles) ends.insert({cycle.lower, cycle.upper});
  std::vector<std::pair<std::size_t, std::size_t>> runs;
  for (auto end = ends.begin(); std::next(end) != ends.end(); ++end)
    runs.emplace_back(*end, *std::next(end));
  return runs;
}

// The possible motions of the robot in a step.
class PossibleSteps {
 public:
  // `seconds`: duration of each step. If they are unknown, steps count as equally long.
  PossibleSteps(std::span<const PoseEdge> steps, std::span<const double> seconds) {
    if (seconds.size() == steps.size() &&
        std::ranges::all_of(seconds, [](double s) { return s > 0.0; }))
      seconds_ = seconds;
    std::vector<double> speeds;
    for (std::size_t k = 0; k < steps.size(); ++k)
      if (!is_unknown_step(steps[k])) speeds.push_back(speed(steps[k].T_from_to, k));
    if (speeds.empty()) return;
    const auto rank = kUsualShare * static_cast<double>(speeds.size() - 1);
    const auto usual = speeds.begin() + static_cast<std::ptrdiff_t>(rank);
    std::ranges::nth_element(speeds, usual);
    fastest_ = kFastestStep * *usual;
  }

  [[nodiscard]] bool contain(const SE3& T, std::size_t step) const {
    return speed(T, step) <= fastest_;
  }
  [[nodiscard]] double speed(const SE3& T, std::size_t step) const {
    return T.translation().norm() / (seconds_.empty() ? 1.0 : seconds_[step]);
  }

 private:
  std::span<const double> seconds_;
  double fastest_ = 0.0;
};

struct Suspicion {
  double limit = 0.0;       // squared length up to which cycles are consistent
  double consistent = 0.0;  // number of places whose cycle contains the step and is consistent
};

// nullopt unless the cycles allow the step to be wrong: hardly any cycle that contains the step is
// consistent. The median error of the cycles without the step shows how noisy odometry and closures
// are; it scales the limit.
std::optional<Suspicion> suspicion_of(const std::vector<ErrorCycle>& cycles, std::size_t step,
                                      int dimension) {
  std::vector<double> without;
  double places_with = 0.0, places_without = 0.0;
  for (const ErrorCycle& cycle : cycles) {
    (cycle.contains(step) ? places_with : places_without) += cycle.weight;
    if (!cycle.contains(step)) without.push_back(cycle.squared);
  }
  if (std::min(places_with, places_without) < kLeastPlaces) return std::nullopt;
  const auto middle = without.begin() + static_cast<std::ptrdiff_t>(without.size() / 2);
  std::ranges::nth_element(without, middle);
  const double limit = pose_quantile(kConsistent, dimension) *
                       std::max(1.0, *middle / pose_quantile(0.5, dimension));
  double consistent = 0.0;
  for (const ErrorCycle& cycle : cycles)
    if (cycle.contains(step) && cycle.squared <= kConsistentMargin * limit)
      consistent += cycle.weight;
  if (consistent > kMostConsistent * places_with) return std::nullopt;
  return Suspicion{limit, consistent};
}

// Every cycle that contains the step yields the jump after the step that would close it. Returns
// the largest set of jumps that agree with one jump of the set.
std::vector<Jump> agreeing_jumps(const OdometryChain& chain, const std::vector<ErrorCycle>& cycles,
                                 std::size_t step, double limit, int dimension) {
  std::vector<Jump> jumps;
  for (const ErrorCycle& cycle : cycles) {
    if (!cycle.contains(step)) continue;
    const SE3 T_next_upper = chain.T_first_kf[step + 1].inverse() * chain.T_first_kf[cycle.upper];
    const Matrix6 Ad = adjoint(T_next_upper);
    jumps.push_back({T_next_upper * se3_exp(-cycle.error) * T_next_upper.inverse(),
                     Ad * cycle.Sigma * Ad.transpose(), cycle.weight});
  }
  std::vector<Jump> most;
  for (const Jump& one : jumps) {
    std::vector<Jump> agreeing;
    for (const Jump& other : jumps)
      if (mahalanobis_length(se3_log(one.T.inverse() * other.T), one.Sigma + other.Sigma, dimension)
              .squared <= limit)
        agreeing.push_back(other);
    if (places_of(agreeing) > places_of(most)) most = std::move(agreeing);
  }
  return most;
}

SE3 mean_of(const std::vector<Jump>& jumps) {
  const SE3& first = jumps.front().T;
  Vector6 sum = Vector6::Zero();
  for (const Jump& jump : jumps) sum += se3_log(first.inverse() * jump.T);
  return first * se3_exp(sum / static_cast<double>(jumps.size()));
}

// The break with the slowest correct step among the steps [first, second), between which closures
// do not distinguish. `jump` is in the frame of keyframe `at` + 1.
OdometryBreak slowest_break(std::span<const PoseEdge> steps, const OdometryChain& chain,
                            const PossibleSteps& possible, std::pair<std::size_t, std::size_t> run,
                            std::size_t at, const SE3& jump) {
  OdometryBreak slowest;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t step = run.first; step < run.second; ++step) {
    const SE3 T_at_step = chain.T_first_kf[at + 1].inverse() * chain.T_first_kf[step + 1];
    const SE3 moved = T_at_step.inverse() * jump * T_at_step;
    const SE3 T = steps[step].T_from_to * moved;
    const double speed = possible.speed(T, step);
    if (!(speed < least)) continue;
    least = speed;
    slowest = {.step = step,
               .T_from_to = T,
               .precision = steps[step].precision,
               .jump_rad = angle_of(moved.linear()),
               .jump_m = moved.translation().norm()};
  }
  return slowest;
}

std::optional<OdometryBreak> find_break(std::span<const PoseEdge> steps,
                                        std::span<const PoseEdge> closures, int dimension,
                                        std::span<const double> seconds) {
  const OdometryChain chain(steps, dimension);
  const std::vector<ErrorCycle> cycles = error_cycles(chain, closures, dimension);
  const PossibleSteps possible(steps, seconds);
  std::optional<OdometryBreak> found;
  double best = 0.0;  // places for a wrong step minus those against it
  for (const auto& run : runs_of_steps(cycles, steps.size())) {
    const std::size_t middle = (run.first + run.second) / 2;
    const auto suspicion = suspicion_of(cycles, middle, dimension);
    if (!suspicion) continue;
    const std::vector<Jump> jumps =
        agreeing_jumps(chain, cycles, middle, suspicion->limit, dimension);
    const double places = places_of(jumps);
    if (places < kLeastPlaces || places - suspicion->consistent <= best) continue;
    OdometryBreak wrong = slowest_break(steps, chain, possible, run, middle, mean_of(jumps));
    if (!possible.contain(wrong.T_from_to, wrong.step)) continue;
    best = places - suspicion->consistent;
    wrong.places = static_cast<std::size_t>(places);
    found = wrong;
  }
  if (!found) return std::nullopt;
  const auto at_most = [](double precision, double size, double factor) {
    return size > 0.0 ? std::min(precision, factor / (size * size)) : precision;
  };
  found->precision.kappa = at_most(found->precision.kappa, found->jump_rad, 0.5);
  found->precision.tau = at_most(found->precision.tau, found->jump_m, 1.0);
  return found;
}

}  // namespace

std::vector<OdometryBreak> find_odometry_breaks(std::span<const PoseEdge> steps,
                                                std::span<const PoseEdge> closures, int dimension,
                                                std::span<const double> seconds) {
  std::vector<PoseEdge> corrected(steps.begin(), steps.end());
  std::vector<OdometryBreak> breaks;
  while (!corrected.empty()) {
    const auto found = find_break(corrected, closures, dimension, seconds);
    if (!found) break;
    if (breaks.size() == kMostBreaks) return {};
    breaks.push_back(*found);
    correct_breaks(corrected, {&*found, 1});
  }
  return breaks;
}

void correct_breaks(std::span<PoseEdge> steps, std::span<const OdometryBreak> breaks) {
  for (const OdometryBreak& found : breaks) {
    steps[found.step].T_from_to = found.T_from_to;
    steps[found.step].precision = found.precision;
  }
}

}  // namespace km
