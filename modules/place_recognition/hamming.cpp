#include "modules/place_recognition/hamming.hpp"

#include <cstring>

namespace km {
namespace {

[[gnu::always_inline]] inline void nearest_of_each_into(std::span<const DescriptorBits> queries,
                                                        std::span<const DescriptorBits> candidates,
                                                        std::vector<NearestBits>& result) {
  const auto count = static_cast<std::uint32_t>(candidates.size());
  for (std::size_t i = 0; i < queries.size(); ++i)
    result[i] = nearest(queries[i], candidates.data(), count);
}

void portable(std::span<const DescriptorBits> queries, std::span<const DescriptorBits> candidates,
              std::vector<NearestBits>& result) {
  nearest_of_each_into(queries, candidates, result);
}

#if defined(__x86_64__)
[[gnu::target("popcnt")]] void with_popcount(std::span<const DescriptorBits> queries,
                                             std::span<const DescriptorBits> candidates,
                                             std::vector<NearestBits>& result) {
  nearest_of_each_into(queries, candidates, result);
}
#endif

}  // namespace

DescriptorBits to_bits(const BinaryDescriptor& descriptor) {
  DescriptorBits bits;
  std::memcpy(bits.word.data(), descriptor.data(), descriptor.size());
  return bits;
}

BinaryDescriptor to_descriptor(const DescriptorBits& bits) {
  BinaryDescriptor descriptor;
  std::memcpy(descriptor.data(), bits.word.data(), descriptor.size());
  return descriptor;
}

bool has_popcount() {
#if defined(__x86_64__)
  static const bool supported = __builtin_cpu_supports("popcnt") != 0;
  return supported;
#else
  return false;
#endif
}

std::vector<NearestBits> nearest_of_each(std::span<const DescriptorBits> queries,
                                         std::span<const DescriptorBits> candidates) {
  std::vector<NearestBits> result(queries.size());
#if defined(__x86_64__)
  if (has_popcount()) {
    with_popcount(queries, candidates, result);
    return result;
  }
#endif
  portable(queries, candidates, result);
  return result;
}

}  // namespace km
