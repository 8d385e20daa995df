#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "modules/place_recognition/bag_of_words.hpp"

namespace km {

/// No image has more words; a message that claims more is refused.
inline constexpr std::size_t kMaxBagWords = 1U << 16U;

/// Encodes a bag of words: the number of words, and two numbers for each word. The first is the
/// number of vocabulary words skipped since the word before, in a Golomb-Rice code for the mean.
/// The second is the count of the word, in an Elias gamma code. 1000 words out of 10000 take about
/// 0.6 kB.
[[nodiscard]] std::vector<std::uint8_t> pack(const BagOfWords& bag);

/// Inverse of pack(). nullopt if the bytes end inside a number or continue after the last one, if a
/// word or count exceeds 32 bits, or if there are more than kMaxBagWords words.
[[nodiscard]] std::optional<BagOfWords> unpack(std::span<const std::uint8_t> bytes);

}  // namespace km
