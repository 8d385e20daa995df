#include "modules/pose_graph/noise_histogram.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

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

struct Fit {
  double share = 0.5;
  double log_likelihood = 0.0;
};

// Share of the lengths that are noise of this scale; the other lengths may have any value.
Fit fit(const NoiseHistogram& histogram, double total, double scale, int components) {
  const double any = 1.0 / std::log(kGreatest / kLeast);
  std::map<std::uint16_t, double> noise;
  for (const auto& [bin, count] : histogram)
    noise[bin] = log_length_density(middle_of(bin) / scale, components);
  const auto mixed = [&](double share, std::uint16_t bin) {
    return share * noise.at(bin) + (1.0 - share) * any + 1e-300;
  };
  Fit fit;
  for (int i = 0; i < kIterations; ++i) {
    double sum = 0.0;
    for (const auto& [bin, count] : histogram)
      sum += count * fit.share * noise.at(bin) / mixed(fit.share, bin);
    fit.share = sum / total;
  }
  for (const auto& [bin, count] : histogram)
    fit.log_likelihood += count * std::log(mixed(fit.share, bin));
  return fit;
}

}  // namespace

void count_length(NoiseHistogram& histogram, double length) {
  if (std::isfinite(length)) ++histogram[bin_of(length)];
}

std::optional<NoiseScale> fit_noise(const NoiseHistogram& histogram, int dimension) {
  NoiseScale result;
  for (const auto& [bin, count] : histogram) result.lengths += count;
  if (result.lengths < kFewLengths) return std::nullopt;
  std::map<double, Fit> fits;  // by scale
  double best = -std::numeric_limits<double>::infinity();
  for (double scale = kLeastScale; scale <= kGreatestScale; scale *= std::exp(kBin)) {
    fits[scale] =
        fit(histogram, static_cast<double>(result.lengths), scale, dimension == 2 ? 3 : 6);
    best = std::max(best, fits[scale].log_likelihood);
  }
  // Takes the scale nearest to the stated noise among those about as likely as the best one. Few
  // lengths make most scales about equally likely, so the stated noise then stays in use.
  double farthest = std::numeric_limits<double>::infinity();
  for (const auto& [scale, found] : fits) {
    if (!(found.log_likelihood >= best - kDoubt) || std::abs(std::log(scale)) >= farthest) continue;
    farthest = std::abs(std::log(scale));
    result.scale = scale;
    result.consistent = found.share;
  }
  return result;
}

}  // namespace km
