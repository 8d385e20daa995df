#include "apps/lab/simulation/world/terrain.hpp"

#include <cmath>

#include "apps/lab/simulation/world/seeded_random.hpp"

namespace km {
namespace {

/// Value in [-1, 1] of a lattice point.
float lattice(std::int64_t i, std::int64_t j, std::uint64_t seed) {
  const std::uint64_t h = scrambled(seed + 0x9E3779B97F4A7C15U * static_cast<std::uint64_t>(i) +
                                    0xC2B2AE3D27D4EB4FU * static_cast<std::uint64_t>(j));
  return static_cast<float>(h >> 40U) * 0x1.0p-23F - 1.0F;
}

float smooth(float t) {
  return t * t * t * (t * (6.0F * t - 15.0F) + 10.0F);
}

}  // namespace

float ground_noise(float x, float y, float feature_m, std::uint64_t seed) {
  const float u = x / feature_m;
  const float v = y / feature_m;
  const float u0 = std::floor(u);
  const float v0 = std::floor(v);
  const auto i = static_cast<std::int64_t>(u0);
  const auto j = static_cast<std::int64_t>(v0);
  const float s = smooth(u - u0);
  const float t = smooth(v - v0);
  const float low = std::lerp(lattice(i, j, seed), lattice(i + 1, j, seed), s);
  const float high = std::lerp(lattice(i, j + 1, seed), lattice(i + 1, j + 1, seed), s);
  return std::lerp(low, high, t);
}

}  // namespace km
