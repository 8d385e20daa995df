#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

namespace km {

/// Rays are traced in packets of sixteen, which are stored side by side.
inline constexpr int kLanes = 16;
using LaneMask = std::uint32_t;  ///< Bit i stands for lane i.
inline constexpr LaneMask kAllLanes = 0xFFFFU;

[[nodiscard]] inline bool has_lane(LaneMask mask, std::size_t lane) {
  return (mask >> lane & 1U) != 0U;
}

/// One value per lane. A plain array: GCC 12 does not vectorise reads of a constant std::array.
template <typename Value>
struct alignas(64) LanesOf {
  Value values[kLanes];

  [[nodiscard]] Value& operator[](std::size_t lane) { return values[lane]; }
  [[nodiscard]] const Value& operator[](std::size_t lane) const { return values[lane]; }
  [[nodiscard]] Value* begin() { return values; }
  [[nodiscard]] const Value* begin() const { return values; }
  [[nodiscard]] const Value* end() const { return values + kLanes; }
  void fill(Value value) {
    for (Value& lane : values) lane = value;
  }
};
using Lanes = LanesOf<float>;
using IntLanes = LanesOf<std::int32_t>;
using BitLanes = LanesOf<std::uint32_t>;

/// Sixteen points or directions.
struct Lanes3 {
  Lanes x, y, z;

  [[nodiscard]] Eigen::Vector3f at(std::size_t lane) const { return {x[lane], y[lane], z[lane]}; }
  void set(std::size_t lane, const Eigen::Vector3f& value) {
    x[lane] = value.x();
    y[lane] = value.y();
    z[lane] = value.z();
  }
};

[[nodiscard]] inline float dot(const Lanes3& a, const Lanes3& b, std::size_t lane) {
  return a.x[lane] * b.x[lane] + a.y[lane] * b.y[lane] + a.z[lane] * b.z[lane];
}

#if defined(__x86_64__)
/// The kernel with all it calls, for processors with AVX2.
template <typename Kernel>
[[gnu::target("avx2"), gnu::flatten]] void run_avx2(const Kernel& kernel) {
  kernel();
}
#endif

/// Runs `kernel`, a lambda that loops over lanes, compiled for the widest vectors of this
/// processor. Results do not depend on the width: the compiler neither reorders sums nor, with
/// -ffp-contract=off, fuses products into them.
template <typename Kernel>
void run_wide(const Kernel& kernel) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) {
    run_avx2(kernel);
    return;
  }
#endif
  kernel();
}

}  // namespace km
