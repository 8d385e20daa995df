#pragma once

#include <cstdint>
#include <map>
#include <optional>

namespace km {

/// How well a graph knows the noise of its closures.
struct NoiseScale {
  double scale = 1.0;       ///< Sigmas of closures are this many times what the graph says.
  double consistent = 1.0;  ///< Share of the lengths that are Gaussian noise of that scale.
  std::size_t lengths = 0;  ///< That it was found from.
};

/// Lengths of cycles [sigma] by their logarithm, told apart to 5 %: robots add theirs up.
using NoiseHistogram = std::map<std::uint16_t, std::uint32_t>;

void count_length(NoiseHistogram& histogram, double length);

/// The scale of the noise of closures, from the Mahalanobis lengths d of cycles through two
/// closures beside each other (see Corroboration::count_lengths()): if both are true, d is `scale`
/// times the length of a normal vector; with a false one it may be any. So the lengths are taken
/// for a mixture of both, log d of the others uniform, and the scale is the likeliest one
/// (expectation maximisation of the share, for every scale). `dimension` 2: of 3 components, else
/// of 6. nullopt if there are too few lengths to tell.
[[nodiscard]] std::optional<NoiseScale> fit_noise(const NoiseHistogram& histogram, int dimension);

}  // namespace km
