#pragma once

#include <place_recognition.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "modules/place_recognition/keyframe_bow.hpp"
#include "runtime/dds/codec.hpp"

namespace km {

/// No image has more words; a message that claims more is refused.
inline constexpr std::size_t kMaxBagWords = 1U << 16U;

/// Bytes of a bag of words. Per word an unsigned LEB128 number 2 * gap + more, where gap is the
/// distance to the smallest word that could follow the one before; if `more` is 1, a second number,
/// count - 2, follows. Most words of an image occur once and lie close together: 1000 words take
/// about 1.2 kB instead of the 6 kB of plain words and weights.
[[nodiscard]] std::vector<std::uint8_t> pack(const BagOfWords& bag);

/// Inverse of pack(). nullopt if the bytes end inside a number, a word or count exceeds 32 bits, or
/// there are more than kMaxBagWords words.
[[nodiscard]] std::optional<BagOfWords> unpack(std::span<const std::uint8_t> bytes);

template <>
struct Codec<KeyframeBow> {
  using Wire = km_wire_BowVector;
  static constexpr const char* kTopic = "bow_vectors";
  static constexpr std::uint16_t kVersion = 1;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_BowVector_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<std::uint8_t> words;
  };
  static Encoded encode(const KeyframeBow& message);
  static Decoded<KeyframeBow> decode(const Wire& wire);
};

}  // namespace km
