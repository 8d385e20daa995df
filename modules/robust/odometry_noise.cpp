#include "modules/robust/odometry_noise.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "modules/robust/closure_places.hpp"
#include "modules/robust/cycle_mixture.hpp"
#include "modules/robust/odometry_cycles.hpp"

namespace km {
namespace {

constexpr std::size_t kMostCycles = 200;
// Largest standard deviation of the rotation of odometry in a cycle of one closure, on each axis.
// Errors of cycles with a larger one are not normally distributed.
constexpr double kLargestNormalTurn_rad = 0.7;
// Weight of a cycle of two closures. Each closure is in two such cycles.
constexpr double kShortCycleWeight = 0.5;
constexpr double kRatioSigma = 0.6931;  // log 2, prior of log sqrt(v_R / v_t)
constexpr int kSweeps = 4;
// Smallest variance factor of closures, and of steps together with closures, that a fit considers.
constexpr double kLeastFactor = 1.0 / 64.0;
constexpr double kMostBeside = 256.0;  // parking-garage claims 200 times its noise
// Odometry of recorded graphs is not white, so that ratios of 4 to 8 also appear. They are ignored:
// ais2klinik in five robots would lose 198 of 1614 true closures with reversed ids.
constexpr double kLeastBeside = 16.0;

using Cycle = OdometryCycle;
using Component = OdometryCycle::Component;
using enum OdometryCycle::Component;
using Factors = std::array<double, kComponents>;

std::vector<PoseEdge> in_order(std::span<const PoseEdge> closures, std::size_t keyframes) {
  std::vector<PoseEdge> sorted;
  for (const PoseEdge& closure : closures)
    if (closure.from.index < keyframes && closure.to.index < keyframes) sorted.push_back(closure);
  std::ranges::sort(sorted, {}, &PoseEdge::id);
  return sorted;
}

// Cycles, with weights such that each place counts once.
std::vector<Cycle> cycles_of(const OdometryChain& chain, std::span<const PoseEdge> closures,
                             std::size_t& places) {
  std::vector<PoseEdge> sorted = in_order(closures, chain.T_first_kf.size());
  std::erase_if(sorted, [&](const PoseEdge& e) { return !chain.joins(e.from.index, e.to.index); });
  const ClosureGroups found = find_places(sorted);
  const std::vector<double> weights = found.weights();
  places = found.sizes.size();
  std::vector<Cycle> cycles;
  const std::size_t stride = (sorted.size() + kMostCycles - 1) / kMostCycles;
  for (std::size_t k = 0; k < sorted.size(); k += stride) {
    cycles.push_back(chain.close(sorted[k]));
    cycles.back().weight = static_cast<double>(stride) * weights[k];
  }
  return cycles;
}

// Cycles through two successive closures near each other.
std::vector<Cycle> short_cycles(const OdometryChain& chain, std::span<const PoseEdge> closures) {
  const std::vector<PoseEdge> sorted = in_order(closures, chain.T_first_kf.size());
  std::vector<Cycle> cycles;
  for (std::size_t k = 0; k + 1 < sorted.size(); ++k) {
    const ClosureId one = sorted[k].id(), other = sorted[k + 1].id();
    const auto steps = steps_between(one.from, other.from) + steps_between(one.to, other.to);
    if (steps == 0 || steps > kNearSteps || !chain.joins(one.from.index, other.from.index) ||
        !chain.joins(one.to.index, other.to.index))
      continue;
    cycles.push_back(chain.close(sorted[k], sorted[k + 1]));
    cycles.back().weight = kShortCycleWeight;
  }
  const std::size_t stride = (cycles.size() + kMostCycles - 1) / kMostCycles;
  for (std::size_t k = 0; k * stride < cycles.size(); ++k) cycles[k] = cycles[k * stride];
  if (stride > 1) cycles.resize((cycles.size() + stride - 1) / stride);
  return cycles;
}

// A closure may join any two places of the trajectory.
double volume_of(const OdometryChain& chain, std::span<const PoseEdge> closures, int dimension) {
  ClosureVolume volume;
  for (const SE3& T : chain.T_first_kf) volume.add_ends(T.translation(), T.translation());
  for (const PoseEdge& closure : closures)
    volume.add_length(closure.T_from_to.translation().norm());
  return volume.of(dimension);
}

// Cycles, and their log densities if they are false.
struct Cycles {
  std::vector<Cycle> cycles;
  std::vector<double> if_false;
  int dimension;

  Cycles(std::vector<Cycle> all, double volume, int in_dimension)
      : cycles(std::move(all)), dimension(in_dimension) {
    for (const Cycle& cycle : cycles)
      if_false.push_back(log_density_if_false(cycle.error, volume, dimension));
  }
  // The same cycles, if false ones end near each other: see log_densities_if_near().
  [[nodiscard]] std::optional<Cycles> near() const {
    std::vector<Vector6> errors;
    for (const Cycle& cycle : cycles) errors.push_back(cycle.error);
    const auto log_if_true = [&](std::size_t k, double noise) {
      return log_density_if_true(cycles[k].error, cycles[k].claimed(noise), dimension);
    };
    auto normal = log_densities_if_near(errors, if_false, log_if_true, dimension);
    if (!normal) return std::nullopt;
    Cycles all = *this;
    all.if_false = std::move(*normal);
    return all;
  }
};

std::vector<double> log_ratios(const Cycles& all, const Factors& v) {
  std::vector<double> ratios;
  for (std::size_t k = 0; k < all.cycles.size(); ++k) {
    const Cycle& cycle = all.cycles[k];
    Matrix6 Sigma = Matrix6::Zero();
    for (std::size_t f = 0; f < kComponents; ++f) Sigma += v[f] * cycle.covariance[f];
    ratios.push_back(log_density_if_true(cycle.error, Sigma, all.dimension) - all.if_false[k]);
  }
  return ratios;
}

std::vector<double> weights_of(const std::vector<Cycle>& cycles) {
  std::vector<double> weights;
  for (const Cycle& cycle : cycles) weights.push_back(cycle.weight);
  return weights;
}

// Log of the posterior density of the factors, at the likeliest share of true closures.
double log_posterior(const Cycles& all, const Factors& v) {
  if (v[kTwoClosures] > v[kClosure]) return -std::numeric_limits<double>::infinity();
  double log_sum = fit_cycle_mixture(log_ratios(all, v), weights_of(all.cycles)).log_likelihood;
  const auto prior = [](double log_root, double sigma) {
    return -0.5 * log_root * log_root / (sigma * sigma);
  };
  for (const double factor : v) log_sum += prior(0.5 * std::log(factor), kNoiseFactorWidth);
  return log_sum + prior(0.5 * std::log(v[kRotation] / v[kTranslation]), kRatioSigma);
}

struct FactorFit {
  Factors factors{1.0, 1.0, 1.0, 1.0};
  double log_posterior = 0.0;
  double log_odds = 0.0;  // that odometry is noisier than it claims
  double share = 0.0;     // share of true cycles
};

// The largest posterior density without noise of odometry: errors that noise of closures alone
// explains are no evidence against odometry.
double log_posterior_of_claims(const Cycles& all) {
  Factors best{1.0, 1.0, 1.0, 1.0};
  double most = log_posterior(all, best);
  for (const bool both : {true, false}) {
    Factors next = best;
    for (double v = kLeastFactor; v <= 4096.0; v *= 2.0) {
      next[kTwoClosures] = v;
      if (both) next[kClosure] = v;
      const double found = log_posterior(all, next);
      if (!(found > most)) continue;
      most = found;
      best = next;
    }
  }
  return most;
}

// A pattern search, coarse to fine: along each factor, and along both factors of odometry or of
// closures. `least`: smallest factor of odometry.
FactorFit fit_factors(const Cycles& all, double least = 1.0) {
  constexpr std::array<Factors, 7> kDirections{{{1.0, 0.0, 0.0, 0.0},
                                                {0.0, 1.0, 0.0, 0.0},
                                                {0.0, 0.0, 1.0, 0.0},
                                                {0.0, 0.0, 1.0, 1.0},
                                                {0.0, 0.0, 0.0, 1.0},
                                                {1.0, 1.0, 0.0, 0.0},
                                                {1.0, -1.0, 0.0, 0.0}}};
  FactorFit fit;
  double most = log_posterior(all, fit.factors);
  const auto try_factors = [&](const Factors& v) {
    const double found = log_posterior(all, v);
    if (!(found > most)) return false;
    most = found;
    fit.factors = v;
    return true;
  };
  // If both factors of odometry are large, steps along one factor at a time do not reach them.
  for (double root = 2.0; root <= 32.0; root *= 2.0)
    (void)try_factors({root * root, root * root, 1.0, 1.0});
  for (double ratio = 2.0; ratio > 1.05; ratio = std::sqrt(ratio))
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      bool is_better = false;
      for (const Factors& direction : kDirections)
        for (const double step : {ratio * ratio, 1.0 / (ratio * ratio)}) {
          Factors next = fit.factors;
          for (std::size_t f = 0; f < kComponents; ++f) next[f] *= std::pow(step, direction[f]);
          for (const Component f : {kRotation, kTranslation}) next[f] = std::max(least, next[f]);
          if (next != fit.factors) is_better |= try_factors(next);
        }
      if (!is_better) break;
    }
  fit.log_posterior = most;
  fit.log_odds = most - log_posterior_of_claims(all);
  fit.share = fit_cycle_mixture(log_ratios(all, fit.factors), weights_of(all.cycles)).share;
  return fit;
}

// The cycles of which the errors are about normal with these factors.
std::vector<Cycle> with_normal_errors(std::vector<Cycle> cycles, const Factors& v, int dimension) {
  std::erase_if(cycles, [&](const Cycle& cycle) {
    const double axes = dimension == 2 ? 1.0 : 3.0;
    const double variance = cycle.covariance[kRotation].topLeftCorner<3, 3>().trace() / axes;
    return v[kRotation] * variance > kLargestNormalTurn_rad * kLargestNormalTurn_rad;
  });
  return cycles;
}

// With the factors of odometry for the closures, too.
std::vector<Cycle> in_common(std::vector<Cycle> cycles) {
  for (Cycle& cycle : cycles) {
    for (const auto part : {kRotation, kTranslation})
      cycle.covariance[part] += cycle.of_closures[part];
    cycle.covariance[kClosure] = cycle.covariance[kTwoClosures] = Matrix6::Zero();
  }
  return cycles;
}

// The closures of the cycles that are more likely true than false.
std::vector<PoseEdge> likely_closures(const Cycles& all, const Factors& v) {
  const std::vector<Cycle>& cycles = all.cycles;
  const std::vector<double> ratios = log_ratios(all, v);
  const CycleMixture mixture = fit_cycle_mixture(ratios, weights_of(cycles));
  std::map<ClosureId, PoseEdge> likely;
  for (std::size_t k = 0; k < cycles.size(); ++k) {
    if (!(mixture.true_probability(ratios[k]) > 0.5)) continue;
    likely.emplace(cycles[k].closure.id(), cycles[k].closure);
    if (cycles[k].other) likely.emplace(cycles[k].other->id(), *cycles[k].other);
  }
  std::vector<PoseEdge> closures;
  for (const auto& [id, closure] : likely) closures.push_back(closure);
  return closures;
}

// How much noisier closures are than odometry, relative to what both claim: a power of two, see
// OdometryNoise::beside. The noise of odometry may be any fraction of what it claims. `otherwise`:
// log posterior density if odometry or closures are noisier than they claim.
double noise_beside_odometry(const Cycles& all, double otherwise) {
  const std::vector<double> weights = weights_of(all.cycles);
  double equal = otherwise, most = -std::numeric_limits<double>::infinity(), best = 1.0,
         share = 0.0;
  for (double ratio = 1.0; ratio <= kMostBeside; ratio *= 2.0) {
    const double away = std::log(ratio) / kNoiseFactorWidth;
    for (double noise = 1.0; noise >= 1.0 / kMostBeside; noise *= 0.5) {
      const double odometry = noise * noise, closures = odometry * ratio * ratio;
      const CycleMixture mixture =
          fit_cycle_mixture(log_ratios(all, {odometry, odometry, closures, closures}), weights);
      const double found = mixture.log_likelihood - 0.5 * away * away;
      if (!(found > most)) continue;
      most = found;
      best = ratio;
      share = mixture.share;
    }
    if (ratio == 1.0) equal = std::max(equal, most);
  }
  const bool likely = most - equal >= kThousandToOne && share > kMostlyTrue;
  return likely && best >= kLeastBeside ? best : 1.0;
}

bool is_noisy(const FactorFit& fit) {
  return fit.log_odds >= kTenToOne && fit.share > kMostlyTrue;
}

}  // namespace

OdometryNoise estimate_odometry_noise(std::span<const PoseEdge> steps,
                                      std::span<const PoseEdge> closures, int dimension) {
  OdometryNoise noise;
  const OdometryChain chain(steps, dimension);
  std::vector<Cycle> cycles = cycles_of(chain, closures, noise.places);
  if (cycles.empty()) return noise;
  const double volume = volume_of(chain, closures, dimension);
  FactorFit fit = fit_factors({cycles, volume, dimension});
  if (!(fit.log_odds >= kTenToOne)) {
    noise.beside = noise_beside_odometry({cycles, volume, dimension}, fit.log_posterior);
    return noise;
  }
  const std::optional<Cycles> near_each_other = Cycles{cycles, volume, dimension}.near();
  if (!is_noisy(fit) || (near_each_other && !is_noisy(fit_factors(*near_each_other)))) return noise;
  const std::vector<Cycle> near = short_cycles(chain, closures);
  std::vector<Cycle> normal = with_normal_errors(cycles, fit.factors, dimension);
  // If most cycles of one closure are left out, noise of closures alone may explain the cycles of
  // successive closures. That does not refute the first estimate, which then remains.
  const bool few_are_long = 2 * normal.size() < cycles.size();
  normal.insert(normal.end(), near.begin(), near.end());
  const FactorFit refined = fit_factors({normal, volume, dimension});
  FactorFit common = fit_factors({in_common(normal), volume, dimension}, kLeastFactor);
  noise.of_closures = common.log_posterior - refined.log_posterior >= kThousandToOne;
  for (double& factor : common.factors) factor = std::max(1.0, factor);
  if (noise.of_closures)
    fit = common;
  else if (refined.log_odds >= kTenToOne)
    fit = refined;
  else if (!few_are_long)
    return noise;
  noise.rotation = std::sqrt(fit.factors[kRotation]);
  noise.translation = std::sqrt(fit.factors[kTranslation]);
  cycles.insert(cycles.end(), near.begin(), near.end());
  if (noise.of_closures) cycles = in_common(std::move(cycles));
  noise.likely = likely_closures({cycles, volume, dimension}, fit.factors);
  if (noise.of_closures)
    for (PoseEdge& e : noise.likely) e.precision = noise.corrected(e.precision);
  return noise;
}

void OdometryJudgement::correct(std::span<PoseEdge> steps) const {
  for (PoseEdge& step : steps) step.precision = noise.corrected(step.precision);
  correct_breaks(steps, breaks);
}

OdometryJudgement judge_odometry(std::span<const PoseEdge> steps,
                                 std::span<const PoseEdge> closures, int dimension,
                                 std::span<const double> seconds, bool corrects) {
  OdometryJudgement judgement;
  if (corrects) judgement.breaks = find_odometry_breaks(steps, closures, dimension, seconds);
  std::vector<PoseEdge> repaired(steps.begin(), steps.end());
  correct_breaks(repaired, judgement.breaks);
  judgement.noise = estimate_odometry_noise(repaired, closures, dimension);
  return judgement;
}

}  // namespace km
