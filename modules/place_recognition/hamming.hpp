#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/data/keyframe.hpp"

namespace km {

/// A descriptor as machine words.
struct alignas(32) DescriptorBits {
  std::array<std::uint64_t, kDescriptorBytes / sizeof(std::uint64_t)> word{};
};

[[nodiscard]] DescriptorBits to_bits(const BinaryDescriptor& descriptor);
[[nodiscard]] BinaryDescriptor to_descriptor(const DescriptorBits& bits);

/// Number of differing bits.
[[gnu::always_inline]] inline unsigned hamming_distance(const DescriptorBits& a,
                                                        const DescriptorBits& b) {
  unsigned distance = 0;
  for (std::size_t i = 0; i < a.word.size(); ++i)
    distance += static_cast<unsigned>(__builtin_popcountll(a.word[i] ^ b.word[i]));
  return distance;
}

/// The candidate descriptor nearest to a query; the first of equally near candidates.
struct NearestBits {
  std::uint32_t index = 0;
  std::uint32_t distance = 0;
};

/// Precondition: `count` > 0. No branch depends on the data, because the distances in quantisation
/// are too similar for an early exit to be predicted.
[[gnu::always_inline]] inline NearestBits nearest(const DescriptorBits& query,
                                                  const DescriptorBits* candidates,
                                                  std::uint32_t count) {
  std::uint32_t best = ~0U;  // distance in the upper, index in the lower half
  for (std::uint32_t c = 0; c < count; ++c) {
    const std::uint32_t key = (hamming_distance(query, candidates[c]) << 16U) | c;
    best = key < best ? key : best;
  }
  return {best & 0xFFFFU, best >> 16U};
}

/// The nearest candidate of each query. Chooses the instructions of this processor at run time.
/// Precondition: 0 < candidates.size() < 65536.
[[nodiscard]] std::vector<NearestBits> nearest_of_each(std::span<const DescriptorBits> queries,
                                                       std::span<const DescriptorBits> candidates);

#if defined(__x86_64__)
template <typename Kernel>
[[gnu::target("popcnt")]] auto run_with_popcount(const Kernel& kernel) {
  return kernel();
}
#endif

/// The result of `kernel`, a lambda with the attribute always_inline. It is compiled twice: for all
/// processors, and for those that count bits in one instruction.
template <typename Kernel>
auto run_counting_bits(const Kernel& kernel) {
#if defined(__x86_64__)
  static const bool supported = __builtin_cpu_supports("popcnt") != 0;
  if (supported) return run_with_popcount(kernel);
#endif
  return kernel();
}

}  // namespace km
