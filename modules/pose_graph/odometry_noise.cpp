#include "modules/pose_graph/odometry_noise.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "modules/pose_graph/closure_places.hpp"
#include "modules/pose_graph/cycle_mixture.hpp"
#include "modules/pose_graph/odometry_cycles.hpp"

namespace km {
namespace {

constexpr std::size_t kMostCycles = 200;
constexpr double kPriorSigma = 1.0986;  // log 3, prior of log sqrt(v)
constexpr double kLeastSide_m = 1.0;    // least side of the volume for false closures
constexpr double kRatioSigma = 0.6931;  // log 2, prior of log sqrt(v_R / v_t)
// Log of the odds from which on odometry counts as noisier than it claims: 1000 to 1.
constexpr double kEvidence = 6.9;
constexpr int kSweeps = 4;

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
  const std::vector<PoseEdge> sorted = in_order(closures, chain.T_first_kf.size());
  const ClosurePlaces found = find_places(sorted);
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

double log_density_if_true(const Cycle& cycle, const Factors& v) {
  const Matrix6 Sigma = v[kRotation] * cycle.covariance[kRotation] +
                        v[kTranslation] * cycle.covariance[kTranslation] +
                        v[kClosure] * cycle.covariance[kClosure];
  const Eigen::LLT<Matrix6> factor(Sigma);
  const Vector6 white = factor.matrixL().solve(cycle.error);
  const double log_root = factor.matrixLLT().diagonal().array().log().sum();
  const double squared = white.squaredNorm();
  return -0.5 * squared - log_root - 3.0 * std::log(2.0 * std::numbers::pi);
}

// The volume [m^3] in which a false closure may end: twice the bounding box of the trajectory,
// enlarged on every side by the length of the longest closure.
double volume_m3(const OdometryChain& chain, std::span<const PoseEdge> closures) {
  Eigen::AlignedBox3d box;
  for (const SE3& T : chain.T_first_kf) box.extend(T.translation());
  double reach_m = 0.0;
  for (const PoseEdge& closure : closures)
    reach_m = std::max(reach_m, closure.T_from_to.translation().norm());
  return (2.0 * box.sizes().array() + 2.0 * reach_m + kLeastSide_m).prod();
}

std::vector<double> log_ratios(const std::vector<Cycle>& cycles,
                               const std::vector<double>& if_false, const Factors& v) {
  std::vector<double> ratios;
  for (std::size_t k = 0; k < cycles.size(); ++k)
    ratios.push_back(log_density_if_true(cycles[k], v) - if_false[k]);
  return ratios;
}

std::vector<double> weights_of(const std::vector<Cycle>& cycles) {
  std::vector<double> weights;
  for (const Cycle& cycle : cycles) weights.push_back(cycle.weight);
  return weights;
}

// Log of the posterior density of the factors, at the likeliest share of true closures.
double log_posterior(const std::vector<Cycle>& cycles, const std::vector<double>& if_false,
                     const Factors& v) {
  double log_sum =
      fit_cycle_mixture(log_ratios(cycles, if_false, v), weights_of(cycles)).log_likelihood;
  const auto prior = [](double log_root, double sigma) {
    return -0.5 * log_root * log_root / (sigma * sigma);
  };
  for (const double factor : v) log_sum += prior(0.5 * std::log(factor), kPriorSigma);
  return log_sum + prior(0.5 * std::log(v[kRotation] / v[kTranslation]), kRatioSigma);
}

}  // namespace

OdometryNoise estimate_odometry_noise(std::span<const PoseEdge> steps,
                                      std::span<const PoseEdge> closures) {
  OdometryNoise noise;
  const OdometryChain chain(steps);
  const std::vector<Cycle> cycles = cycles_of(chain, closures, noise.places);
  if (cycles.empty()) return noise;
  std::vector<double> if_false;
  const double volume = volume_m3(chain, closures);
  for (const Cycle& cycle : cycles) if_false.push_back(log_density_if_false(cycle.error, volume));

  // A pattern search, coarse to fine: along each factor, and along both factors of odometry.
  constexpr std::array<Factors, 5> kDirections{
      {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}, {1.0, 1.0, 0.0}, {1.0, -1.0, 0.0}}};
  Factors best{1.0, 1.0, 1.0};
  double most = log_posterior(cycles, if_false, best);
  const auto try_factors = [&](const Factors& v) {
    const double found = log_posterior(cycles, if_false, v);
    if (found <= most) return false;
    most = found;
    best = v;
    return true;
  };
  // If both factors of odometry are large, steps along one factor at a time do not reach them.
  for (double root = 2.0; root <= 32.0; root *= 2.0)
    (void)try_factors({root * root, root * root, 1.0});
  for (double ratio = 2.0; ratio > 1.05; ratio = std::sqrt(ratio))
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      bool is_better = false;
      for (const Factors& direction : kDirections)
        for (const double step : {ratio * ratio, 1.0 / (ratio * ratio)}) {
          Factors next = best;
          for (std::size_t f = 0; f < kComponents; ++f) next[f] *= std::pow(step, direction[f]);
          for (const Component f : {kRotation, kTranslation}) next[f] = std::max(1.0, next[f]);
          if (next != best) is_better |= try_factors(next);
        }
      if (!is_better) break;
    }
  // Errors that noise of closures alone explains are no evidence against odometry.
  double without = log_posterior(cycles, if_false, {1.0, 1.0, 1.0});
  for (double v = 1.0 / 64.0; v <= 4096.0; v *= 2.0)
    without = std::max(without, log_posterior(cycles, if_false, {1.0, 1.0, v}));
  if (most - without < kEvidence) return noise;
  noise.rotation = std::sqrt(best[kRotation]);
  noise.translation = std::sqrt(best[kTranslation]);
  const std::vector<double> ratios = log_ratios(cycles, if_false, best);
  const CycleMixture mixture = fit_cycle_mixture(ratios, weights_of(cycles));
  for (std::size_t k = 0; k < cycles.size(); ++k)
    if (mixture.true_probability(ratios[k]) > 0.5) noise.likely.push_back(cycles[k].closure);
  return noise;
}

}  // namespace km
