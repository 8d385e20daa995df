#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <random>
#include <span>
#include <vector>

namespace km {

/// How long to sample.
struct RansacOptions {
  double confidence = 0.999;  ///< Probability of having drawn one sample without outliers.
  int max_iterations = 2000;
};

/// The model with the least cost and the data that agree with it.
template <typename Model>
struct RansacResult {
  std::optional<Model> model;        ///< Empty if no sample gave one.
  std::vector<std::size_t> inliers;  ///< Ascending.
  double cost = std::numeric_limits<double>::infinity();
  int iterations = 0;
};

/// Random sample consensus (Fischler and Bolles, CACM 1981) with truncated costs (MSAC: Torr and
/// Zisserman, "MLESAC", CVIU 2000) and a local optimisation of each new best model (Chum, Matas,
/// Kittler, "Locally Optimized RANSAC", DAGM 2003). The number of iterations adapts to the best
/// share of inliers. Deterministic by the state of `rng`.
///
/// `Problem` provides, for data 0 .. size() - 1:
///     static constexpr std::size_t kSampleSize;
///     std::size_t size() const;
///     std::size_t drawable() const;  // samples hold numbers 0 .. drawable() - 1, which need not
///                                    // be those of the data: only solve() reads them
///     std::optional<Model> solve(std::span<const std::size_t> sample) const;  // minimal
///     double error(const Model&, std::size_t i) const;   // 0 .. 1 inlier, above 1 outlier
///     std::optional<Model> polish(const Model&, std::span<const std::size_t> inliers) const;
template <typename Model, typename Problem>
[[nodiscard]] RansacResult<Model> ransac(const Problem& problem, const RansacOptions& options,
                                         std::mt19937& rng) {
  RansacResult<Model> best;
  const std::size_t n = problem.size();
  const std::size_t drawable = problem.drawable();
  if (drawable < Problem::kSampleSize) return best;

  const auto consider = [&](const Model& model) {
    double cost = 0.0;
    std::vector<std::size_t> inliers;
    for (std::size_t i = 0; i < n && cost < best.cost; ++i) {
      const double error = problem.error(model, i);
      if (error <= 1.0) inliers.push_back(i);
      cost += std::min(error, 1.0);
    }
    if (!(cost < best.cost)) return false;
    best.model = model;
    best.cost = cost;
    best.inliers = std::move(inliers);
    return true;
  };

  std::uniform_int_distribution<std::size_t> draw(0, drawable - 1);
  double needed = options.max_iterations;
  for (; best.iterations < needed; ++best.iterations) {
    std::array<std::size_t, Problem::kSampleSize> sample;
    for (std::size_t k = 0; k < sample.size();) {
      sample[k] = draw(rng);
      if (std::find(sample.begin(), sample.begin() + k, sample[k]) == sample.begin() + k) ++k;
    }
    const std::optional<Model> model = problem.solve(sample);
    if (!model || !consider(*model)) continue;
    const std::optional<Model> polished = problem.polish(*best.model, best.inliers);
    if (polished) consider(*polished);
    const double share = static_cast<double>(best.inliers.size()) / static_cast<double>(n);
    const double clean = std::pow(share, static_cast<double>(sample.size()));
    const double adapted =
        std::log1p(-options.confidence) / std::log1p(-std::min(clean, 1 - 1e-12));
    if (clean > 0.0) needed = std::min(needed, std::ceil(adapted));
  }
  return best;
}

}  // namespace km
