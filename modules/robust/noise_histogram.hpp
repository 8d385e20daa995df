#pragma once

#include <cstdint>
#include <map>
#include <optional>

namespace km {

/// Estimate of the noise of the closures of a graph.
struct NoiseScale {
  double scale = 1.0;       ///< Noise scale: actual over stated standard deviations.
  double consistent = 1.0;  ///< Share of the lengths that fit Gaussian noise of this scale.
  std::size_t lengths = 0;  ///< Number of lengths behind the estimate.
};

/// Histogram of cycle lengths [sigma] in logarithmic bins of 5 %. The team sums the histograms of
/// its robots.
using NoiseHistogram = std::map<std::uint16_t, std::uint32_t>;

void count_length(NoiseHistogram& histogram, double length);

/// The noise scale of closures, from the Mahalanobis lengths d of cycles through two closures near
/// each other (see Corroboration::count_lengths()). If both closures are true, d is `scale` times
/// the length of a normal vector; with a false closure, d may have any value. The normal vector has
/// 6 components (`dimension` 2: 3). The model is a mixture of both, with log d uniform for cycles
/// with a false closure. For every scale, expectation maximisation fits the share of true cycles.
/// The result is the scale nearest to 1 among those about as likely as the best one. nullopt if
/// there are too few lengths.
///
/// If this scale exceeds 10, it may be the size of false cycles. The lengths are then fitted by two
/// populations, see METHOD.md. Smaller scales are not examined: recorded closures are up to four
/// times as noisy as they claim.
[[nodiscard]] std::optional<NoiseScale> fit_noise(const NoiseHistogram& histogram, int dimension);

}  // namespace km
