#include "modules/robust/closure_noise.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "modules/core/geometry/symmetric_eigen.hpp"
#include "modules/robust/cycle_mixture.hpp"

namespace km {
namespace {

// Odometry may be this many times noisier than expected before its errors count as evidence against
// closures. Sensitivity: METHOD.md.
constexpr double kNoisyOdometry = 1.5;
constexpr double kOneSigma = 0.5;  // loss of log density at one standard deviation of log s
// Upper end of the grid, relative to the team: closures with more noise carry no information.
constexpr double kLargestFactor = 10.0;
constexpr double kGridStep = 1.1;  // a tenth of the standard deviation is precise enough
// Noise factor of the team beyond which its claimed noise says nothing about single pairs.
constexpr double kClaimsFail = 1.5;
// With fewer places, some of them false, the noise of the true ones cannot be estimated.
constexpr double kFewPlaces = 5.0;
// Least mean log density ratio of a cycle with the estimated noise to a false cycle. It rejects
// very large noise, with which closures that are all false would be as likely true. Sensitivity:
// METHOD.md.
constexpr double kDistinct = 2.0;

struct Posterior {
  double log_density = 0.0;  // log posterior density of the factor s, up to a constant
  double distinct = 0.0;     // mean log density ratio of a cycle to a false one
};

// Log density ratio of a cycle, true over false. Closures are `s` times and odometry is `odometry`
// times noisier than claimed.
double log_ratio_of(const NoiseCycle& cycle, double s, double odometry) {
  double log_if_true = 0.0;
  for (std::size_t k = 0; k < cycle.axes; ++k) {
    const double variance = odometry * odometry + s * s * static_cast<double>(cycle.variance[k]);
    const double error = cycle.error[k];
    log_if_true -= 0.5 * (error * error / variance + std::log(variance));
  }
  return log_if_true - static_cast<double>(cycle.log_if_false);
}

// The odometry is `odometry` times noisier than it claims.
Posterior posterior_of(std::span<const NoiseCycle> cycles, std::span<const double> weights,
                       double s, double usual, double odometry) {
  std::vector<double> log_ratio;
  for (const NoiseCycle& cycle : cycles) log_ratio.push_back(log_ratio_of(cycle, s, odometry));
  const double away = std::log(s / usual) / kNoiseFactorWidth;
  const double log_likelihood = fit_cycle_mixture(log_ratio, weights).log_likelihood;
  const double total = weights.front() * static_cast<double>(weights.size());
  return {log_likelihood - std::log1p(away * away), log_likelihood / total};
}

std::vector<double> weights_of(std::span<const NoiseCycle> cycles, double observations) {
  const double weight = std::min(1.0, observations / static_cast<double>(cycles.size()));
  return std::vector<double>(cycles.size(), weight);
}

struct Estimate {
  double factor = 1.0;
  double log_odds = 0.0;  // odds of the most likely factor against the usual one
};

// The odometry is `odometry` times noisier than it claims. Factors with which true cycles are less
// than `distinct` from false ones do not count, see Posterior.
Estimate estimate(std::span<const NoiseCycle> cycles, double observations, double usual,
                  double odometry, double distinct) {
  const std::vector<double> weights = weights_of(cycles, observations);
  const double log_usual = posterior_of(cycles, weights, usual, usual, odometry).log_density;
  if (!std::isfinite(log_usual)) return {usual, 0.0};
  std::vector<std::pair<double, double>> densities{{usual, log_usual}};  // by factor
  double most = log_usual;
  const double largest = std::max(1.0, kLargestFactor * usual);
  for (int k = 1; usual * std::pow(kGridStep, k) <= largest; ++k) {
    const double s = usual * std::pow(kGridStep, k);
    const Posterior found = posterior_of(cycles, weights, s, usual, odometry);
    if (!(found.distinct > distinct)) continue;
    densities.emplace_back(s, found.log_density);
    most = std::max(most, found.log_density);
  }
  const auto credible = [&](const auto& entry) { return entry.second >= most - kOneSigma; };
  return {std::ranges::find_if(densities, credible)->first, most - log_usual};
}

// Log of the odds that closures have the factor `s`, against `other`, without a prior.
double log_odds(std::span<const NoiseCycle> cycles, double observations, double s, double other,
                double odometry) {
  if (cycles.empty()) return 0.0;
  const std::vector<double> weights = weights_of(cycles, observations);
  return posterior_of(cycles, weights, s, s, odometry).log_density -
         posterior_of(cycles, weights, other, other, odometry).log_density;
}

// Log of the odds that some cycles have the usual noise and those of the factor `s` are false,
// against all of them having this factor.
double log_odds_of_two(std::span<const NoiseCycle> cycles, std::span<const double> weights,
                       double usual, double s, double odometry) {
  std::vector<double> wide, shorter;
  for (const NoiseCycle& cycle : cycles) wide.push_back(log_ratio_of(cycle, s, odometry));
  const CycleMixture one = fit_cycle_mixture(wide, weights);
  for (std::size_t k = 0; k < cycles.size(); ++k)
    shorter.push_back(log_ratio_of(cycles[k], usual, odometry) - one.log_density(wide[k]));
  return fit_cycle_mixture(shorter, weights).log_likelihood;
}

// The factor of cycles of one kind. A team whose cycles are shorter than claimed has better
// odometry than it claims, too. Errors of its closures would otherwise be within the claims of
// odometry.
double factor_of(std::span<const NoiseCycle> cycles, double observations, double usual) {
  const double odometry = std::min(1.0, kNoisyOdometry * usual);
  if (cycles.empty() || observations < kFewPlaces || usual > kClaimsFail) return usual;
  const Estimate found = estimate(cycles, observations, usual, odometry, kDistinct);
  const bool likely =
      found.log_odds >= kThousandToOne &&
      estimate(cycles, observations, usual, kNoisyOdometry * odometry, 0.0).log_odds >=
          kThousandToOne;
  if (!likely) return usual;
  const std::vector<double> weights = weights_of(cycles, observations);
  const bool is_two =
      log_odds_of_two(cycles, weights, usual, found.factor, odometry) >= kThousandToOne;
  return is_two ? usual : found.factor;
}

}  // namespace

NoiseCycle NoiseCycle::of(const Vector6& e, const Matrix6& Sigma_o, const Matrix6& Sigma_c,
                          double log_if_false, int dimension) {
  const Eigen::Index first = dimension == 2 ? 2 : 0;
  const Eigen::Index size = dimension == 2 ? 3 : 6;
  const Eigen::MatrixXd odometry = Sigma_o.block(first, first, size, size);
  const Eigen::MatrixXd closures = Sigma_c.block(first, first, size, size);
  const Eigen::LLT<Eigen::MatrixXd> root(odometry);
  const auto L = root.matrixL();
  const Eigen::MatrixXd half = L.solve(closures);
  const SymmetricEigen eigen = symmetric_eigen(Eigen::MatrixXd(L.solve(half.transpose())));
  const auto whitened = [&](const Vector6& v) {
    std::array<float, 6> white = {};
    Eigen::Map<Eigen::VectorXf>(white.data(), size) =
        (eigen.vectors.transpose() * L.solve(Eigen::VectorXd(v.segment(first, size))))
            .cast<float>();
    return white;
  };
  NoiseCycle cycle{.error = whitened(e), .axes = static_cast<std::size_t>(size)};
  for (Eigen::Index k = 0; k < size; ++k) {
    cycle.variance[static_cast<std::size_t>(k)] =
        static_cast<float>(std::max(0.0, eigen.values(k)));
  }
  const double log_root = root.matrixLLT().diagonal().array().log().sum();
  cycle.log_if_false = static_cast<float>(
      log_if_false + log_root + 0.5 * static_cast<double>(size) * std::log(2.0 * std::numbers::pi));
  return cycle;
}

bool shows_noise(const PairCycles& cycles) {
  return cycles.places >= kFewPlaces;
}

bool shows_factor(const PairCycles& cycles, double usual, double factor) {
  const double odometry = std::min(1.0, kNoisyOdometry * usual);
  return log_odds(cycles.inside, cycles.places, factor, usual, odometry) >= kThousandToOne ||
         log_odds(cycles.between, cycles.places, factor, usual, odometry) >= kThousandToOne;
}

bool excludes_noise(const PairCycles& cycles, double excluded, double factor) {
  return log_odds(cycles.between, cycles.places, factor, excluded, 1.0) >= kThousandToOne;
}

double estimate_closure_noise(const PairCycles& cycles, double usual) {
  return std::max(factor_of(cycles.inside, cycles.places, usual),
                  factor_of(cycles.between, cycles.places, usual));
}

}  // namespace km
