#include "modules/robust/noise_histogram.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "modules/robust/cycle_mixture.hpp"

namespace km {
namespace {

constexpr std::size_t kFewLengths = 5;
constexpr double kBin = 0.05;  // width of a bin in log d
constexpr double kLeast = 1e-4;
constexpr double kGreatest = 1e3;
constexpr double kLeastScale = 1e-3;
constexpr double kGreatestScale = 100.0;
constexpr int kIterations = 40;
// Loss of log-likelihood up to which a scale is as good as the best one (Wilks: 2 is the 95 %
// interval).
constexpr double kDoubt = 4.0;
// A larger scale may be that of false cycles. Chosen by graphs that were seen: closures of the
// tunnels are 3.8 times as noisy as stated. False cycles of a smaller scale are treated as noise.
constexpr double kSuspicious = 10.0;
// Least ratio of the sizes of false cycles and noise. One population whose lengths are not exactly
// those of normal vectors would otherwise count as two.
constexpr double kFarApart = 4.0;
constexpr double kCoarse = 4.0;  // steps of the sizes of false cycles, in bins

std::uint16_t bin_of(double length) {
  return static_cast<std::uint16_t>(std::log(std::clamp(length, kLeast, kGreatest) / kLeast) /
                                    kBin);
}

double middle_of(std::uint16_t bin) {
  return kLeast * std::exp(kBin * (static_cast<double>(bin) + 0.5));
}

// Density of log |x| for a normal vector x with this number of components.
double log_length_density(double length, int components) {
  const double k = components;
  return std::exp(k * std::log(length) - 0.5 * length * length -
                  (0.5 * k - 1.0) * std::numbers::ln2 - std::lgamma(0.5 * k));
}

// A population of cycles: log d is that of a normal vector times `centre`, blurred by `width`.
struct Population {
  double centre = 1.0;
  double width = 0.0;
};

using Densities = std::vector<double>;  // density of log d in each bin

Densities densities_of(const NoiseHistogram& histogram, const Population& population,
                       int components) {
  constexpr int kPoints = 5;  // on each side, every half standard deviation
  const int points = population.width > 0.0 ? kPoints : 0;
  Densities densities(histogram.size(), 0.0);
  double total = 0.0;
  for (int point = -points; point <= points; ++point) {
    const double offset = 0.5 * point;
    const double weight = std::exp(-0.5 * offset * offset);
    const double size = population.centre * std::exp(offset * population.width);
    std::size_t k = 0;
    for (const auto& [bin, count] : histogram)
      densities[k++] += weight * log_length_density(middle_of(bin) / size, components);
    total += weight;
  }
  for (double& density : densities) density /= total;
  return densities;
}

struct Fit {
  std::vector<double> shares = {};  // Populations; the other lengths may be any
  double log_likelihood = 0.0;
};

Fit fit(const NoiseHistogram& histogram, double total,
        const std::vector<const Densities*>& populations) {
  const double any = 1.0 / std::log(kGreatest / kLeast);
  const double even = 1.0 / static_cast<double>(populations.size() + 1);
  Fit fit{.shares = std::vector<double>(populations.size(), even)};
  const auto mixed = [&](std::size_t k) {
    double density = 1e-300, rest = 1.0;
    for (std::size_t p = 0; p < populations.size(); ++p) {
      density += fit.shares[p] * (*populations[p])[k];
      rest -= fit.shares[p];
    }
    return density + std::max(0.0, rest) * any;
  };
  for (int i = 0; i < kIterations; ++i) {
    std::vector<double> sums(populations.size(), 0.0);
    std::size_t k = 0;
    for (const auto& [bin, count] : histogram) {
      const double density = mixed(k);
      for (std::size_t p = 0; p < populations.size(); ++p)
        sums[p] += count * fit.shares[p] * (*populations[p])[k] / density;
      ++k;
    }
    for (std::size_t p = 0; p < populations.size(); ++p) fit.shares[p] = sums[p] / total;
  }
  std::size_t k = 0;
  for (const auto& [bin, count] : histogram) fit.log_likelihood += count * std::log(mixed(k++));
  return fit;
}

// The scale nearest to 1 among those about as likely as the best one. Few lengths make most scales
// about equally likely, so that the stated noise stays in use.
NoiseScale nearest_to_stated(const std::map<double, Fit>& fits) {
  double best = -std::numeric_limits<double>::infinity();
  for (const auto& [scale, found] : fits) best = std::max(best, found.log_likelihood);
  NoiseScale nearest;
  double farthest = std::numeric_limits<double>::infinity();
  for (const auto& [scale, found] : fits) {
    if (!(found.log_likelihood >= best - kDoubt) || std::abs(std::log(scale)) >= farthest) continue;
    farthest = std::abs(std::log(scale));
    nearest.scale = scale;
    nearest.consistent = found.shares.front();
  }
  return nearest;
}

// Cycles with false closures between parts of the environment that look alike have lengths of one
// size, too, and may be the larger population. They are never the shorter one, because a false
// closure adds its error to the noise. If two populations that are far from each other explain the
// lengths much better than one population of any width, the shorter one is the noise.
std::optional<NoiseScale> shorter_population(const NoiseHistogram& histogram, double total,
                                             const std::map<double, Densities>& noise,
                                             int components) {
  constexpr std::array<double, 4> kWidths{0.0, 0.3, 0.6, 0.9};
  double one = -std::numeric_limits<double>::infinity(), two = one;
  std::map<double, Fit> fits;  // by the scale of the shorter population
  for (double centre = 1.0; centre <= kGreatestScale; centre *= std::exp(kCoarse * kBin))
    for (const double width : kWidths) {
      const Densities longer = densities_of(histogram, {centre, width}, components);
      one = std::max(one, fit(histogram, total, {&longer}).log_likelihood);
      for (const auto& [scale, shorter] : noise) {
        if (scale * kFarApart > centre) break;
        const Fit found = fit(histogram, total, {&shorter, &longer});
        two = std::max(two, found.log_likelihood);
        Fit& best = fits.try_emplace(scale, found).first->second;
        if (found.log_likelihood > best.log_likelihood) best = found;
      }
    }
  if (!(two - one >= kThousandToOne)) return std::nullopt;
  return nearest_to_stated(fits);
}

}  // namespace

void count_length(NoiseHistogram& histogram, double length) {
  if (std::isfinite(length)) ++histogram[bin_of(length)];
}

std::optional<NoiseScale> fit_noise(const NoiseHistogram& histogram, int dimension) {
  std::size_t lengths = 0;
  for (const auto& [bin, count] : histogram) lengths += count;
  if (lengths < kFewLengths) return std::nullopt;
  const auto total = static_cast<double>(lengths);
  const int components = dimension == 2 ? 3 : 6;
  std::map<double, Densities> noise;  // by scale
  std::map<double, Fit> fits;
  for (double scale = kLeastScale; scale <= kGreatestScale; scale *= std::exp(kBin)) {
    noise[scale] = densities_of(histogram, {scale, 0.0}, components);
    fits[scale] = fit(histogram, total, {&noise[scale]});
  }
  NoiseScale result = nearest_to_stated(fits);
  if (result.scale > kSuspicious)
    result = shorter_population(histogram, total, noise, components).value_or(result);
  result.lengths = lengths;
  return result;
}

}  // namespace km
