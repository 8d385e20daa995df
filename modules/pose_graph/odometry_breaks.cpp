#include "modules/pose_graph/odometry_breaks.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <optional>
#include <set>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/pose_graph/closure_places.hpp"
#include "modules/pose_graph/odometry_cycles.hpp"

namespace km {
namespace {

// Quantiles of chi-squared, 6 degrees of freedom: 99.9 % and the median.
constexpr double kConsistent = 22.46;
constexpr double kMedian = 5.35;
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

double squared_length(const Vector6& error, const Matrix6& Sigma) {
  return error.dot(Sigma.ldlt().solve(error));
}

std::vector<ErrorCycle> error_cycles(const OdometryChain& chain,
                                     std::span<const PoseEdge> closures) {
  std::vector<PoseEdge> inside;
  for (const PoseEdge& e : closures)
    if (std::max(e.from.index, e.to.index) < chain.T_first_kf.size()) inside.push_back(e);
  std::ranges::sort(inside, {}, &PoseEdge::id);
  const std::vector<double> weights = find_places(inside).weights();
  const std::size_t stride = (inside.size() + kMostErrorCycles - 1) / kMostErrorCycles;
  std::vector<ErrorCycle> cycles;
  for (std::size_t k = 0; k < inside.size(); k += stride) {
    const OdometryCycle cycle = chain.close(inside[k]);
    const Matrix6 Sigma = cycle.claimed();
    cycles.push_back({cycle.lower, cycle.upper, cycle.error, Sigma,
                      squared_length(cycle.error, Sigma),
                      static_cast<double>(stride) * weights[k]});
  }
  return cycles;
}

// One step of each run of steps that are in the same cycles: the middle one.
std::vector<std::size_t> distinct_steps(const std::vector<ErrorCycle>& cycles, std::size_t steps) {
  std::set<std::size_t> ends{0, steps};
  for (const ErrorCycle& cycle : cycles) ends.insert({cycle.lower, cycle.upper});
  std::vector<std::size_t> middles;
  for (auto end = ends.begin(); std::next(end) != ends.end(); ++end)
    middles.push_back((*end + *std::next(end)) / 2);
  return middles;
}

struct Suspicion {
  double limit = 0.0;       // squared length up to which cycles are consistent
  double consistent = 0.0;  // number of places whose cycle contains the step and is consistent
};

// nullopt unless the cycles allow the step to be wrong: hardly any cycle that contains the step is
// consistent. The median error of the cycles without the step shows how noisy odometry and closures
// are; it scales the limit.
std::optional<Suspicion> suspicion_of(const std::vector<ErrorCycle>& cycles, std::size_t step) {
  std::vector<double> without;
  double places_with = 0.0, places_without = 0.0;
  for (const ErrorCycle& cycle : cycles) {
    (cycle.contains(step) ? places_with : places_without) += cycle.weight;
    if (!cycle.contains(step)) without.push_back(cycle.squared);
  }
  if (std::min(places_with, places_without) < kLeastPlaces) return std::nullopt;
  const auto middle = without.begin() + static_cast<std::ptrdiff_t>(without.size() / 2);
  std::ranges::nth_element(without, middle);
  const double limit = kConsistent * std::max(1.0, *middle / kMedian);
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
                                 std::size_t step, double limit) {
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
      if (squared_length(se3_log(one.T.inverse() * other.T), one.Sigma + other.Sigma) <= limit)
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

std::optional<OdometryBreak> find_break(std::span<const PoseEdge> steps,
                                        std::span<const PoseEdge> closures) {
  const OdometryChain chain(steps);
  const std::vector<ErrorCycle> cycles = error_cycles(chain, closures);
  std::optional<std::size_t> where;
  std::vector<Jump> most;
  double best = 0.0;  // places for a wrong step minus those against it
  for (const std::size_t step : distinct_steps(cycles, steps.size())) {
    const auto suspicion = suspicion_of(cycles, step);
    if (!suspicion) continue;
    std::vector<Jump> jumps = agreeing_jumps(chain, cycles, step, suspicion->limit);
    const double places = places_of(jumps);
    if (places < kLeastPlaces || places - suspicion->consistent <= best) continue;
    best = places - suspicion->consistent;
    most = std::move(jumps);
    where = step;
  }
  if (!where) return std::nullopt;
  const SE3 jump = mean_of(most);
  OdometryBreak found{.step = *where,
                      .T_from_to = steps[*where].T_from_to * jump,
                      .precision = steps[*where].precision,
                      .jump_rad = angle_of(jump.linear()),
                      .jump_m = jump.translation().norm(),
                      .places = static_cast<std::size_t>(places_of(most))};
  const auto at_most = [](double precision, double size, double factor) {
    return size > 0.0 ? std::min(precision, factor / (size * size)) : precision;
  };
  found.precision.kappa = at_most(found.precision.kappa, found.jump_rad, 0.5);
  found.precision.tau = at_most(found.precision.tau, found.jump_m, 1.0);
  return found;
}

}  // namespace

std::vector<OdometryBreak> find_odometry_breaks(std::span<const PoseEdge> steps,
                                                std::span<const PoseEdge> closures) {
  std::vector<PoseEdge> corrected(steps.begin(), steps.end());
  std::vector<OdometryBreak> breaks;
  while (!corrected.empty()) {
    const auto found = find_break(corrected, closures);
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
