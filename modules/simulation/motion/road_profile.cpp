#include "modules/simulation/motion/road_profile.hpp"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "modules/simulation/motion/gaussian_random.hpp"

namespace km {
namespace {

constexpr double kInterval_m = 0.1;
constexpr double kDensity_m3 = 16e-6;        // at kReferenceFrequency: geometric mean of class A
constexpr double kReferenceFrequency = 0.1;  // [cycles/m]
constexpr double kMemory_m = 15.0;           // after which heights are forgotten

// A density falling with the square of the frequency is that of a random walk: its slope is white,
// with the one-sided density (2 pi n)^2 G(n), half of which is the variance of the increments per
// metre. The walk leaks, which keeps it near 0.
UniformSpline<1> random_walk(double begin_m, double end_m, double roughness, std::uint64_t seed) {
  const double turn = 2.0 * std::numbers::pi * kReferenceFrequency;
  const double step = roughness * std::sqrt(0.5 * turn * turn * kDensity_m3 * kInterval_m);
  const double leak = std::exp(-kInterval_m / kMemory_m);
  GaussianRandom random{SeededRandom(seed)};
  std::vector<UniformSpline<1>::Vector> heights;
  UniformSpline<1>::Vector height(step / std::sqrt(1.0 - leak * leak) * random.draw());
  const double intervals = std::ceil((end_m - begin_m) / kInterval_m);
  for (double k = -5.0; k < intervals; ++k) {
    heights.push_back(height);
    height[0] = leak * height[0] + step * random.draw();
  }
  return {begin_m, kInterval_m, std::move(heights)};
}

}  // namespace

RoadProfile::RoadProfile(double begin_m, double end_m, double roughness, std::uint64_t seed)
    : curve_(random_walk(begin_m, end_m, roughness, seed)) {}

}  // namespace km
