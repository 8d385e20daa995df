#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>

namespace km {

/// Finaliser of SplitMix64 (Steele, Lea, Flood, OOPSLA 2014): makes neighbouring values unrelated.
[[nodiscard]] inline std::uint64_t scrambled(std::uint64_t x) {
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9U;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBU;
  return x ^ (x >> 31U);
}

/// Random draws that are equal on every platform, because std::mt19937_64 is specified bit by bit.
/// The distributions of the standard library are not specified and therefore not used. Values are
/// drawn in call order.
class SeededRandom {
 public:
  explicit SeededRandom(std::uint64_t seed) : engine_(mixed(seed)) {}

  /// An independent stream for part `part`: draws of one part do not change the others.
  [[nodiscard]] static SeededRandom stream(std::uint64_t seed, std::uint64_t part) {
    return SeededRandom(mixed(seed) ^ mixed(~part));
  }

  [[nodiscard]] double unit() {
    return static_cast<double>(engine_() >> 11) * 0x1.0p-53;
  }  ///< [0, 1)
  [[nodiscard]] float uniform(float low, float high) {
    return low + (high - low) * static_cast<float>(unit());
  }
  /// 0 .. count - 1; `count` at least 1.
  [[nodiscard]] int below(int count) {
    return static_cast<int>(unit() * static_cast<double>(count));
  }
  [[nodiscard]] bool chance(double probability) { return unit() < probability; }
  /// Either -1 or 1.
  [[nodiscard]] float sign() { return chance(0.5) ? 1.0F : -1.0F; }

  template <typename T, std::size_t kExtent>
  [[nodiscard]] const T& pick(const T (&values)[kExtent]) {
    return values[below(static_cast<int>(kExtent))];
  }

 private:
  static std::uint64_t mixed(std::uint64_t x) { return scrambled(x + 0x9E3779B97F4A7C15U); }

  std::mt19937_64 engine_;
};

/// Standard normal draws from SeededRandom by the method of Box and Muller (1958).
class GaussianRandom {
 public:
  explicit GaussianRandom(SeededRandom random) : random_(random) {}

  [[nodiscard]] double draw() {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    const double radius = std::sqrt(-2.0 * std::log(1.0 - random_.unit()));
    const double angle = 2.0 * std::numbers::pi * random_.unit();
    spare_ = radius * std::sin(angle);
    has_spare_ = true;
    return radius * std::cos(angle);
  }

  [[nodiscard]] Eigen::Vector3d draw3() {
    Eigen::Vector3d values;
    for (double& value : values) value = draw();
    return values;
  }

 private:
  SeededRandom random_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace km
