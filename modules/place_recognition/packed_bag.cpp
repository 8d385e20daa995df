#include "modules/place_recognition/packed_bag.hpp"

#include <bit>
#include <limits>

#include "modules/place_recognition/packed_bits.hpp"

namespace km {
namespace {

constexpr std::uint64_t kMax32 = std::numeric_limits<std::uint32_t>::max();
constexpr unsigned kParameterBits = 5;

// Parameter k of the shortest Golomb-Rice code: 2^k is about ln 2 times the mean gap.
unsigned rice_parameter(std::uint64_t range, std::size_t words) {
  const std::uint64_t typical = range / words * 45 / 64;
  return typical > 1 ? static_cast<unsigned>(std::bit_width(typical)) - 1 : 0;
}

}  // namespace

std::vector<std::uint8_t> pack(const BagOfWords& bag) {
  BitWriter bits;
  bits.gamma(bag.size() + 1);
  if (bag.empty()) return bits.take();
  const unsigned parameter = rice_parameter(std::uint64_t{bag.back().word} + 1, bag.size());
  bits.bits(parameter, kParameterBits);
  std::uint64_t next = 0;  // smallest word that can follow
  for (const auto& [word, count] : bag) {
    bits.rice(word - next, parameter);
    bits.gamma(count);
    next = std::uint64_t{word} + 1;
  }
  return bits.take();
}

std::optional<BagOfWords> unpack(std::span<const std::uint8_t> bytes) {
  BitReader bits(bytes);
  const auto size_and_one = bits.gamma();
  if (!size_and_one || *size_and_one > kMaxBagWords + 1) return std::nullopt;
  const auto parameter = *size_and_one > 1 ? bits.bits(kParameterBits) : 0;
  if (!parameter) return std::nullopt;
  BagOfWords bag;
  std::uint64_t next = 0;
  while (bag.size() + 1 < *size_and_one) {
    const auto gap = bits.rice(static_cast<unsigned>(*parameter));
    const auto count = bits.gamma();
    if (!gap || !count || *gap > kMax32 || next + *gap > kMax32 || *count > kMax32)
      return std::nullopt;
    const std::uint64_t word = next + *gap;
    bag.push_back({static_cast<std::uint32_t>(word), static_cast<std::uint32_t>(*count)});
    next = word + 1;
  }
  return bits.ended() ? std::optional(std::move(bag)) : std::nullopt;
}

}  // namespace km
