#include "modules/loop_closure/matched_numbers.hpp"

#include <algorithm>
#include <cmath>

namespace km {
namespace {

constexpr int kLargest = 7;  // number of 4 bits
constexpr int kZero = 8;     // is stored for a number of 0

}  // namespace

MatchedDescriptor descriptor_of_numbers(std::span<const float> numbers) {
  double squares = 0.0;
  for (const float x : numbers) squares += static_cast<double>(x) * static_cast<double>(x);
  const double factor =
      squares > 0.0 ? kNumberSteps * std::sqrt(static_cast<double>(kMatchedNumbers) / squares)
                    : 0.0;
  MatchedDescriptor descriptor{};
  for (std::size_t i = 0; i < kMatchedNumbers; ++i) {
    const double steps = std::clamp<double>(std::round(factor * static_cast<double>(numbers[i])),
                                            -kLargest, kLargest);
    const auto stored = static_cast<unsigned>(static_cast<int>(steps) + kZero);
    descriptor[i / 2] |= static_cast<std::uint8_t>(stored << (i % 2 == 0 ? 0U : 4U));
  }
  return descriptor;
}

std::array<std::int16_t, kMatchedNumbers> numbers_of(const MatchedDescriptor& descriptor) {
  std::array<std::int16_t, kMatchedNumbers> numbers{};
  for (std::size_t i = 0; i < kMatchedNumbers; ++i) {
    const unsigned stored = descriptor[i / 2] >> (i % 2 == 0 ? 0U : 4U) & 0xFU;
    numbers[i] = static_cast<std::int16_t>(static_cast<int>(stored) - kZero);
  }
  return numbers;
}

}  // namespace km
