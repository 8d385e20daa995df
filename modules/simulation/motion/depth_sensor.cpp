#include "modules/simulation/motion/depth_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>

#include "modules/simulation/motion/gaussian_random.hpp"

namespace km {
namespace {

constexpr double kLargest_mm = 65535.0;
constexpr double kBlockTolerance_px = 0.5;  // by which something nearer must cover a pixel

std::uint16_t millimetres(double depth_m) {
  const double rounded = std::round(1000.0 * depth_m);
  return rounded > 0.0 && rounded <= kLargest_mm ? static_cast<std::uint16_t>(rounded) : 0;
}

// Standard normal noise over an image, smooth between the nodes of a lattice of `spacing` pixels:
// a matcher compares windows, so that neighbours err alike. Of variance 1 at every pixel.
class SmoothNoise {
 public:
  SmoothNoise(int width, int height, int spacing, GaussianRandom& random)
      : spacing_(spacing), columns_(width / spacing + 2) {
    const std::size_t nodes =
        static_cast<std::size_t>(columns_) * static_cast<std::size_t>(height / spacing + 2);
    for (std::size_t k = 0; k < nodes; ++k) nodes_.push_back(random.draw());
  }

  [[nodiscard]] double at(int x, int y) const {
    const double u = static_cast<double>(x % spacing_) / spacing_;
    const double v = static_cast<double>(y % spacing_) / spacing_;
    const int column = x / spacing_, row = y / spacing_;
    const double sum = (1.0 - v) * ((1.0 - u) * node(column, row) + u * node(column + 1, row)) +
                       v * ((1.0 - u) * node(column, row + 1) + u * node(column + 1, row + 1));
    // Variance of the sum: the squares of the four weights.
    return sum / std::sqrt(((1.0 - u) * (1.0 - u) + u * u) * ((1.0 - v) * (1.0 - v) + v * v));
  }

 private:
  [[nodiscard]] double node(int column, int row) const {
    return nodes_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                  static_cast<std::size_t>(column)];
  }

  int spacing_, columns_;
  std::vector<double> nodes_;
};

// True disparities [px], 0 at infinity.
std::vector<double> disparities(std::span<const float> depth_m, double focal_baseline) {
  std::vector<double> d(depth_m.size());
  for (std::size_t k = 0; k < d.size(); ++k)
    d[k] = depth_m[k] > 0.0F ? focal_baseline / static_cast<double>(depth_m[k]) : 0.0;
  return d;
}

// Pixels whose match in the right image, at x - d, lies behind that of a pixel farther right.
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

bool at_edge(std::span<const double> disparity, std::size_t width, std::size_t k, double jump_px) {
  const std::size_t x = k % width;
  const auto jumps = [&](std::size_t other) {
    return std::abs(disparity[k] - disparity[other]) > jump_px;
  };
  return (x > 0 && jumps(k - 1)) || (x + 1 < width && jumps(k + 1)) ||
         (k >= width && jumps(k - width)) || (k + width < disparity.size() && jumps(k + width));
}

}  // namespace

DepthSensor::DepthSensor(const DepthSensorOptions& options) : options_(checked(options)) {}

std::vector<std::uint16_t> DepthSensor::measure(std::span<const float> depth_m, int width,
                                                int height, std::uint64_t seed) const {
  if (width <= 0 || height <= 0 ||
      depth_m.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw std::invalid_argument("depth sensor: " + std::to_string(depth_m.size()) + " depths for " +
                                std::to_string(width) + "x" + std::to_string(height) + " pixels");
  std::vector<std::uint16_t> measured(depth_m.size(), 0);
  if (options_.ideal) {
    std::transform(depth_m.begin(), depth_m.end(), measured.begin(),
                   [](float z) { return millimetres(static_cast<double>(z)); });
    return measured;
  }

  const double focal_baseline = options_.focal_px * options_.baseline_m;
  const auto columns = static_cast<std::size_t>(width);
  const std::vector<double> disparity = disparities(depth_m, focal_baseline);
  std::vector<bool> lost(depth_m.size(), false);
  mark_blocked(disparity, columns, lost);
  GaussianRandom gaussian(SeededRandom::stream(seed, 41));
  const SmoothNoise noise(width, height, options_.correlation_px, gaussian);
  auto edges = SeededRandom::stream(seed, 42);
  const double step = options_.disparity_step_px;

  for (std::size_t k = 0; k < measured.size(); ++k) {
    const auto z = static_cast<double>(depth_m[k]);
    if (lost[k] || !(z >= options_.min_range_m && z <= options_.max_range_m)) continue;
    if (at_edge(disparity, columns, k, options_.edge_disparity_px) &&
        edges.chance(options_.edge_loss))
      continue;
    const int x = static_cast<int>(k % columns), y = static_cast<int>(k / columns);
    double d = disparity[k] + options_.disparity_noise_px * noise.at(x, y);
    if (step > 0.0) d = step * std::round(d / step);
    if (d > 0.0) measured[k] = millimetres(focal_baseline / d);
  }
  return measured;
}

}  // namespace km
