#include "modules/robust/corroboration.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "modules/core/data/covariance.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/outlier_rejection/chi_squared.hpp"
#include "modules/robust/closure_places.hpp"
#include "modules/robust/cycle_mixture.hpp"

namespace km {
namespace {

constexpr std::uint32_t kBeside = 5;  // largest distance of near closures, at both ends [keyframes]
constexpr double kLargestTurn = 0.25 * std::numbers::pi;
// Largest number of steps of odometry in a cycle between two places. The noise of more steps would
// hide the noise of the closures.
constexpr std::uint32_t kStepsBetweenPlaces = 60;
// Share of the errors of the path that count as drift. Errors at the solution are smaller: nine
// true closures that variants of COSMO-Bench had lost have at most 0.4 of this squared length.
constexpr double kPossible = 0.5;
// Precision of an identity.
constexpr Precision kExact{1e18, 1e18};
// Largest standard deviation of the rotation of odometry in a cycle between two places. Errors of
// cycles with a larger one are not normally distributed.
constexpr double kLargestTurnSigma_rad = 0.5;

}  // namespace

Corroboration::Corroboration(std::span<const PoseEdge> closures, const PoseOf& pose,
                             const std::map<RobotId, Precision>& step, int dimension,
                             LaterRuns later_runs)
    : pose_(pose),
      step_(step),
      dimension_(dimension),
      later_runs_(std::move(later_runs)),
      edges_(closures) {
  for (const auto& [id, k] : order_of(closures)) {
    const PoseEdge& e = closures[k];
    closures_.push_back(
        {k, id.from, id.to, e.from == id.from ? e.T_from_to : e.T_from_to.inverse(), e.precision});
  }
}

// False if a step between the lower or between the upper ends is unknown.
bool Corroboration::same_runs(const Upward& one, const Upward& other) const {
  const auto run_of = [this](const KeyframeId& id) {
    const auto runs = later_runs_.find(id.robot);
    return runs == later_runs_.end()
               ? std::ptrdiff_t{0}
               : std::ranges::upper_bound(runs->second, id.index) - runs->second.begin();
  };
  return run_of(one.lower) == run_of(other.lower) && run_of(one.upper) == run_of(other.upper);
}

Precision Corroboration::step_of(RobotId robot, const Precision& otherwise) const {
  const auto step = step_.find(robot);
  return step == step_.end() ? otherwise : step->second;
}

TwoClosureCycle Corroboration::cycle_of(const Upward& one, const Upward& other, bool levers) const {
  const auto chain = [&](const KeyframeId& from, const KeyframeId& to) {
    const SE3 T = pose_(from).inverse() * pose_(to);
    Matrix6 Sigma = steps_between(from, to) * covariance_in(step_of(from.robot), dimension_);
    const double lever = levers ? Sigma(2, 2) * T.translation().squaredNorm() / 3.0 : 0.0;
    Sigma.diagonal().segment<2>(3).array() += lever;
    if (dimension_ == 3) Sigma(5, 5) += lever;
    return UncertainPose{T, Sigma};
  };
  const auto measured = [&](const Upward& c) {
    return UncertainPose{c.T_lower_upper, covariance_in(c.precision, dimension_)};
  };
  return {measured(one), chain(one.upper, other.upper), inverse(measured(other)),
          chain(other.lower, one.lower)};
}

double Corroboration::cycle_length(const Upward& one, const Upward& other) const {
  const TwoClosureCycle cycle = cycle_of(one, other, false);
  const SE3 T = cycle.T();
  if (!(angle_of(T.linear()) <= kLargestTurn)) return std::numeric_limits<double>::infinity();
  return std::sqrt(mahalanobis_length(se3_log(T), cycle.covariance(), dimension_).squared);
}

// Without the even choice, all cycles may be at one end of the trajectories.
std::vector<Corroboration::Near> Corroboration::nearest(std::vector<Near> cycles,
                                                        std::size_t most) {
  std::ranges::stable_sort(cycles, {}, &Near::steps);
  if (cycles.size() <= most) return cycles;
  const auto equal = std::ranges::equal_range(cycles, cycles[most - 1].steps, {}, &Near::steps);
  const auto before = static_cast<std::size_t>(equal.begin() - cycles.begin());
  const std::size_t wanted = most - before;
  for (std::size_t k = 0; k < wanted; ++k)
    cycles[before + k] = cycles[before + (2 * k + 1) * equal.size() / (2 * wanted)];
  cycles.resize(most);
  return cycles;
}

void Corroboration::count_lengths(NoiseHistogram& histogram, std::size_t most) const {
  std::vector<Near> cycles;
  for (std::size_t a = 0; a < closures_.size(); ++a)
    for (std::size_t b = a + 1; b < closures_.size(); ++b) {
      if (steps_between(closures_[a].lower, closures_[b].lower) > kNearSteps) break;
      const std::uint32_t steps = steps_between(closures_[a].lower, closures_[b].lower) +
                                  steps_between(closures_[a].upper, closures_[b].upper);
      if (steps <= kNearSteps && same_runs(closures_[a], closures_[b]))
        cycles.push_back({steps, a, b});
    }
  for (const Near& c : nearest(std::move(cycles), most))
    count_length(histogram, cycle_length(closures_[c.a], closures_[c.b]));
}

NoiseCycle Corroboration::noise_cycle(const Upward& one, const Upward& other, double volume) const {
  const TwoClosureCycle cycle = cycle_of(one, other, true);
  const Vector6 error = se3_log(cycle.T());
  return NoiseCycle::of(error, cycle.covariance_of_odometry(), cycle.covariance_of_closures(),
                        log_density_if_false(error, volume, dimension_), dimension_);
}

double Corroboration::volume() const {
  ClosureVolume volume;
  for (const Upward& c : closures_) {
    volume.add_ends(pose_(c.lower).translation(), pose_(c.upper).translation());
    volume.add_length(c.T_lower_upper.translation().norm());
  }
  return volume.of(dimension_);
}

// Standard deviation of the rotation of the odometry between two closures, on each axis.
double Corroboration::turn_rad(const Upward& one, const Upward& other) const {
  double variance = 0.0;
  for (const auto& [from, to] : {std::pair(one.lower, other.lower), {one.upper, other.upper}})
    variance += steps_between(from, to) * covariance_in(step_of(from.robot), dimension_)(2, 2);
  return std::sqrt(variance);
}

void Corroboration::count_cycles(PairCycles& cycles) const {
  if (closures_.size() < 2) return;
  const ClosureGroups places = find_places(edges_);
  std::vector<bool> is_first;  // the closure is the first one of its place
  std::vector<bool> seen(places.sizes.size(), false);
  for (const Upward& c : closures_) {
    const std::size_t place = places.group_of[c.index];
    is_first.push_back(!seen[place]);
    seen[place] = true;
  }
  std::vector<Near> inside, between;
  for (std::size_t a = 0; a < closures_.size(); ++a)
    for (std::size_t b = a + 1; b < closures_.size(); ++b) {
      const std::uint32_t lower = steps_between(closures_[a].lower, closures_[b].lower);
      if (lower > kStepsBetweenPlaces || closures_[a].lower.robot != closures_[b].lower.robot)
        break;
      const std::uint32_t steps = lower + steps_between(closures_[a].upper, closures_[b].upper);
      if (steps == 0) continue;  // no odometry between them
      if (!same_runs(closures_[a], closures_[b])) continue;
      const bool same = places.group_of[closures_[a].index] == places.group_of[closures_[b].index];
      if (same && steps <= kNearSteps) inside.push_back({steps, a, b});
      if (!same && is_first[a] && is_first[b] && steps <= kStepsBetweenPlaces &&
          turn_rad(closures_[a], closures_[b]) <= kLargestTurnSigma_rad)
        between.push_back({steps, a, b});
    }
  const double room = volume();
  for (const Near& pair : nearest(std::move(inside), kMostNoiseCycles))
    cycles.inside.push_back(noise_cycle(closures_[pair.a], closures_[pair.b], room));
  for (const Near& pair : nearest(std::move(between), kMostNoiseCycles))
    cycles.between.push_back(noise_cycle(closures_[pair.a], closures_[pair.b], room));
  cycles.places += static_cast<double>(places.sizes.size());
}

bool Corroboration::agree(const Upward& one, const Upward& other, double barc) const {
  if (steps_between(one.upper, other.upper) > kBeside || !same_runs(one, other)) return false;
  const SE3 T = pose_(one.lower).inverse() * pose_(other.lower) * other.T_lower_upper *
                pose_(other.upper).inverse() * pose_(one.upper);
  const SE3& measured = one.T_lower_upper;
  const auto& [kappa, tau] = one.precision;
  const double turned = kappa * (T.linear() - measured.linear()).squaredNorm();
  const double moved = tau * (T.translation() - measured.translation()).squaredNorm();
  // Variances of the cycle, in multiples of the variance of a closure: those of both closures and
  // of every step. A step counts as at least as noisy as a closure. A rotation also moves the far
  // end of a closure.
  double turn = 2.0, shift = 2.0;
  for (const auto& [from, to] : {std::pair(one.lower, other.lower), {one.upper, other.upper}}) {
    const Precision precision = step_of(from.robot, one.precision);
    turn += steps_between(from, to) * std::max(1.0, kappa / precision.kappa);
    shift += steps_between(from, to) * std::max(1.0, tau / precision.tau);
  }
  const double lever = tau / kappa * measured.translation().squaredNorm();
  return turned <= barc * barc * turn && moved <= barc * barc * (shift + turn * lever);
}

std::vector<bool> Corroboration::isolated(double barc) const {
  std::vector<bool> isolated(closures_.size(), true);
  for (std::size_t a = 0; a < closures_.size(); ++a)
    for (std::size_t b = a + 1; b < closures_.size(); ++b) {
      if (steps_between(closures_[a].lower, closures_[b].lower) > kBeside) break;
      // Either direction suffices, because the lever arms of near closures may differ.
      if (!agree(closures_[a], closures_[b], barc) && !agree(closures_[b], closures_[a], barc))
        continue;
      isolated[closures_[a].index] = isolated[closures_[b].index] = false;
    }
  return isolated;
}

std::vector<bool> Corroboration::possible(const std::vector<bool>& kept) const {
  const double quantile = pose_quantile(kPossible, dimension_);
  std::vector<bool> possible(closures_.size(), false);
  for (const Upward& one : closures_) {
    if (kept[one.index]) continue;
    // Without a kept closure near it, a closure inside one robot is compared with its odometry.
    const Upward along{one.index, one.lower, one.lower, SE3::Identity(), kExact};
    const Upward* nearest = one.lower.robot == one.upper.robot ? &along : nullptr;
    const auto steps_to = [&one](const Upward& other) {
      return steps_between(one.lower, other.lower) + steps_between(one.upper, other.upper);
    };
    for (const Upward& other : closures_)
      if (kept[other.index] && same_runs(one, other) &&
          (nearest == nullptr || steps_to(other) < steps_to(*nearest)))
        nearest = &other;
    if (nearest == nullptr || !same_runs(one, *nearest)) continue;
    const TwoClosureCycle cycle = cycle_of(one, *nearest, true);
    const SE3 T = cycle.T();
    possible[one.index] =
        angle_of(T.linear()) <= kLargestTurn &&
        mahalanobis_length(se3_log(T), cycle.covariance(), dimension_).squared <= quantile;
  }
  return possible;
}

}  // namespace km
