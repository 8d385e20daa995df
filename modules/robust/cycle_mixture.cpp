#include "modules/robust/cycle_mixture.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace km {
namespace {

constexpr int kShareSteps = 5;
constexpr double kLeastSide_m = 1.0;  // side of the volume for false closures
constexpr double kLeastShare = 0.02;
constexpr double kSomeTrue = 2.0 * kLeastShare;  // a smaller share may be that of no cycle
// exp() of a larger log density ratio overflows.
constexpr double kLargestLogRatio = 600.0;

double ratio_of(double log_ratio) {
  return std::exp(std::clamp(log_ratio, -kLargestLogRatio, kLargestLogRatio));
}

}  // namespace

double CycleMixture::true_probability(double log_ratio) const {
  const double ratio = ratio_of(log_ratio);
  return share * ratio / (share * ratio + 1.0 - share);
}

double CycleMixture::log_density(double log_ratio) const {
  return std::log(share * ratio_of(log_ratio) + 1.0 - share);
}

CycleMixture fit_cycle_mixture(std::span<const double> log_ratio, std::span<const double> weight) {
  CycleMixture mixture;
  double total = 0.0;
  for (const double w : weight) total += w;
  if (!(total > 0.0)) return mixture;
  for (int i = 0; i < kShareSteps; ++i) {
    double sum = 0.0;
    for (std::size_t k = 0; k < log_ratio.size(); ++k)
      sum += weight[k] * mixture.true_probability(log_ratio[k]);
    mixture.share = std::clamp(sum / total, kLeastShare, 1.0 - kLeastShare);
  }
  for (std::size_t k = 0; k < log_ratio.size(); ++k)
    mixture.log_likelihood += weight[k] * mixture.log_density(log_ratio[k]);
  return mixture;
}

double log_density_if_false(const Vector6& error, double volume, int dimension) {
  if (dimension == 2) return -std::log(2.0 * std::numbers::pi) - std::log(volume);
  const double angle = error.head<3>().norm();
  const double det_J = angle < 1e-3 ? 1.0 : 2.0 * (1.0 - std::cos(angle)) / (angle * angle);
  constexpr double kRotations = 8.0 * std::numbers::pi * std::numbers::pi;
  return 2.0 * std::log(det_J) - std::log(kRotations) - std::log(volume);
}

void ClosureVolume::add_ends(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper) {
  below_.extend(lower);
  above_.extend(upper);
}

void ClosureVolume::add_length(double length_m) {
  reach_m_ = std::max(reach_m_, length_m);
}

double ClosureVolume::of(int dimension) const {
  const Eigen::Array3d sides =
      below_.sizes().array() + above_.sizes().array() + 2.0 * reach_m_ + kLeastSide_m;
  return sides.head(dimension).prod();
}

std::optional<std::vector<double>> log_densities_if_near(
    std::span<const Vector6> errors, const std::vector<double>& uniform,
    const std::function<double(std::size_t, double)>& log_if_true, int dimension) {
  double squares = 0.0, gain = 0.0;
  for (const Vector6& e : errors) squares += e.tail<3>().squaredNorm();
  const double variance = squares / static_cast<double>(dimension * std::ssize(errors));
  const double log_scale = 0.5 * dimension * std::log(2.0 * std::numbers::pi * variance);
  std::vector<double> normal;
  for (std::size_t k = 0; k < errors.size(); ++k) {
    normal.push_back(log_density_if_false(errors[k], 1.0, dimension) - log_scale -
                     0.5 * errors[k].tail<3>().squaredNorm() / variance);
    gain += normal.back() - uniform[k];
  }
  if (!(gain > 0.0)) return std::nullopt;
  std::vector<double> ratios;
  for (std::size_t k = 0; k < errors.size(); ++k) {
    double most = -std::numeric_limits<double>::infinity();
    for (const double noise : kNoiseOfClosures) most = std::max(most, log_if_true(k, noise));
    ratios.push_back(most - normal[k]);
  }
  const std::vector<double> weights(errors.size(), 1.0);
  if (!(fit_cycle_mixture(ratios, weights).share > kSomeTrue)) return std::nullopt;
  return normal;
}

}  // namespace km
