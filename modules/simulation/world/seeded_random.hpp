#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>

namespace km {

/// Random draws that are equal on every platform: std::mt19937_64 is specified bit by bit, the
/// distributions of the standard library are not. Values are drawn in call order.
class SeededRandom {
 public:
  explicit SeededRandom(std::uint64_t seed) : engine_(mixed(seed)) {}

  /// A stream of its own for a named part: what one part draws does not shift the others.
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

  template <typename T, std::size_t extent>
  [[nodiscard]] const T& pick(std::span<const T, extent> values) {
    return values[static_cast<std::size_t>(below(static_cast<int>(values.size())))];
  }

 private:
  // Finaliser of SplitMix64 (Steele, Lea, Flood, OOPSLA 2014): neighbouring seeds become unrelated.
  static std::uint64_t mixed(std::uint64_t x) {
    x += 0x9E3779B97F4A7C15U;
    x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9U;
    x = (x ^ (x >> 27U)) * 0x94D049BB133111EBU;
    return x ^ (x >> 31U);
  }

  std::mt19937_64 engine_;
};

}  // namespace km
