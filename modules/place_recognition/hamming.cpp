#include "modules/place_recognition/hamming.hpp"

#include <cstring>

namespace km {

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

std::vector<NearestBits> nearest_of_each(std::span<const DescriptorBits> queries,
                                         std::span<const DescriptorBits> candidates) {
  const auto count = static_cast<std::uint32_t>(candidates.size());
  std::vector<NearestBits> result(queries.size());
  run_counting_bits([&]() __attribute__((always_inline)) {
    for (std::size_t i = 0; i < queries.size(); ++i)
      result[i] = nearest(queries[i], candidates.data(), count);
  });
  return result;
}

}  // namespace km
