#include "apps/lab/simulation/motion/depth_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "apps/lab/simulation/world/seeded_random.hpp"

namespace km {
namespace {

constexpr double kLargest_mm = 65535.0;
constexpr double kNoise_px = 0.15;          // standard deviation of a disparity
constexpr double kStep_px = 1.0 / 16;       // sub-pixel steps of the matcher
constexpr std::size_t kCorrelation_px = 4;  // width over which noise is correlated
constexpr double kEdge_px = 1.0;   // difference to a neighbour above which a pixel is an edge
constexpr double kEdgeLoss = 0.5;  // probability of no depth at an edge
constexpr double kBlockTolerance_px = 0.5;  // width by which a nearer surface must cover a pixel

// Rounds half away from zero, for positive values; std::round costs a call.
double rounded(double positive) {
  // NOLINTNEXTLINE(bugprone-incorrect-roundings)
  return static_cast<double>(static_cast<std::int64_t>(positive + 0.5));
}

std::uint16_t millimetres(double depth_m) {
  if (!(depth_m > 0.0 && depth_m < 2e-3 * kLargest_mm)) return 0;
  const double mm = rounded(1000.0 * depth_m);
  return mm <= kLargest_mm ? static_cast<std::uint16_t>(mm) : std::uint16_t{0};
}

// Standard normal noise over an image, smooth between the nodes of a lattice of `spacing` pixels. A
// matcher compares windows, so the errors of neighbours are correlated. Variance 1 at every pixel.
class SmoothNoise {
 public:
  SmoothNoise(std::size_t width, std::size_t height, std::size_t spacing, GaussianRandom& random)
      : spacing_(spacing), columns_(width / spacing + 2), along_(columns_), row_(width) {
    for (std::size_t k = 0; k < spacing; ++k) {
      const double u = static_cast<double>(k) / static_cast<double>(spacing);
      const double scale =
          1.0 / std::hypot(1.0 - u, u);  // one over the standard deviation of the sum
      weights_.emplace_back(scale * (1.0 - u), scale * u);
    }
    const std::size_t nodes = columns_ * (height / spacing + 2);
    for (std::size_t k = 0; k < nodes; ++k) nodes_.push_back(random.draw());
  }

  // Noise of the pixels in row `y`; valid until the next call.
  [[nodiscard]] std::span<const double> row(std::size_t y) {
    const auto [above, below] = weights_[y % spacing_];
    const double* const upper = &nodes_[y / spacing_ * columns_];
    for (std::size_t k = 0; k < columns_; ++k)
      along_[k] = above * upper[k] + below * upper[k + columns_];
    for (std::size_t x = 0; x < row_.size(); ++x) {
      const auto [left, right] = weights_[x % spacing_];
      row_[x] = left * along_[x / spacing_] + right * along_[x / spacing_ + 1];
    }
    return row_;
  }

 private:
  std::size_t spacing_, columns_;
  std::vector<std::pair<double, double>> weights_;  // weights of the two nodes around a pixel
  std::vector<double> nodes_;
  std::vector<double> along_, row_;
};

// True disparities [px], 0 at infinity.
std::vector<double> disparities(std::span<const float> depth_m, double focal_baseline) {
  std::vector<double> d(depth_m.size());
  for (std::size_t k = 0; k < d.size(); ++k)
    d[k] = depth_m[k] > 0.0F ? focal_baseline / static_cast<double>(depth_m[k]) : 0.0;
  return d;
}

// Marks pixels whose match in the right image, at x - d, is occluded by that of a pixel farther
// right.
void mark_blocked(std::span<const double> disparity, std::size_t width, std::vector<bool>& lost) {
  for (std::size_t row = 0; row < disparity.size(); row += width) {
    double leftmost = std::numeric_limits<double>::infinity();
    for (std::size_t x = width; x-- > 0;) {
      const double match = static_cast<double>(x) - disparity[row + x];
      if (match > leftmost + kBlockTolerance_px) lost[row + x] = true;
      leftmost = std::min(leftmost, match);
    }
  }
}

// True if a pixel's disparity differs from that of a neighbour by more than `jump_px`.
bool at_edge(std::span<const double> disparity, std::size_t width, std::size_t x, std::size_t k,
             double jump_px) {
  const auto jumps = [&](std::size_t other) {
    return std::abs(disparity[k] - disparity[other]) > jump_px;
  };
  return (x > 0 && jumps(k - 1)) || (x + 1 < width && jumps(k + 1)) ||
         (k >= width && jumps(k - width)) || (k + width < disparity.size() && jumps(k + width));
}

std::uint16_t depth_at(double disparity_px, double focal_baseline) {
  if (!(disparity_px > 0.0)) return 0;
  disparity_px = kStep_px * rounded(disparity_px / kStep_px);
  return disparity_px > 0.0 ? millimetres(focal_baseline / disparity_px) : std::uint16_t{0};
}

}  // namespace

std::vector<std::uint16_t> measured_depth(std::span<const float> depth_m, int width, int height,
                                          std::uint64_t seed, const DepthSensorOptions& options) {
  std::vector<std::uint16_t> measured(depth_m.size(), 0);
  const double focal_baseline = options.focal_px * options.baseline_m;
  const auto columns = static_cast<std::size_t>(width), rows = static_cast<std::size_t>(height);
  const std::vector<double> disparity = disparities(depth_m, focal_baseline);
  std::vector<bool> lost(depth_m.size(), false);
  mark_blocked(disparity, columns, lost);
  GaussianRandom gaussian(SeededRandom::stream(seed, 41));
  SmoothNoise noise(columns, rows, kCorrelation_px, gaussian);
  auto edges = SeededRandom::stream(seed, 42);

  for (std::size_t y = 0; y < rows; ++y) {
    const std::span<const double> errors = noise.row(y);
    for (std::size_t x = 0; x < columns; ++x) {
      const std::size_t k = y * columns + x;
      const auto z = static_cast<double>(depth_m[k]);
      if (lost[k] || !(z >= options.min_range_m && z <= options.max_range_m)) continue;
      if (at_edge(disparity, columns, x, k, kEdge_px) && edges.chance(kEdgeLoss)) continue;
      measured[k] = depth_at(disparity[k] + kNoise_px * errors[x], focal_baseline);
    }
  }
  return measured;
}

}  // namespace km
