#include "modules/place_recognition/place_recognition_codec.hpp"

#include <limits>
#include <utility>

#include "runtime/dds/wire_sequence.hpp"

namespace km {
namespace {

constexpr std::uint64_t kMax32 = std::numeric_limits<std::uint32_t>::max();
constexpr std::size_t kMaxPackedBytes = 10 * kMaxBagWords;  // two numbers of 5 bytes for a word

void append_number(std::vector<std::uint8_t>& bytes, std::uint64_t number) {
  for (; number >= 0x80; number >>= 7U)
    bytes.push_back(static_cast<std::uint8_t>(0x80U | (number & 0x7FU)));
  bytes.push_back(static_cast<std::uint8_t>(number));
}

// Takes a number from the front of `bytes`. 35 bits suffice for all that pack() writes.
std::optional<std::uint64_t> take_number(std::span<const std::uint8_t>& bytes) {
  std::uint64_t number = 0;
  for (unsigned shift = 0; shift < 35 && !bytes.empty(); shift += 7) {
    const std::uint8_t byte = bytes.front();
    bytes = bytes.subspan(1);
    number |= std::uint64_t{byte & 0x7FU} << shift;
    if (byte < 0x80) return number;
  }
  return std::nullopt;
}

}  // namespace

std::vector<std::uint8_t> pack(const BagOfWords& bag) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(bag.size() * 5 / 4);
  std::uint64_t next = 0;  // smallest word that can follow
  for (const auto& [word, count] : bag) {
    append_number(bytes, 2 * (word - next) + (count > 1 ? 1U : 0U));
    if (count > 1) append_number(bytes, count - 2);
    next = std::uint64_t{word} + 1;
  }
  return bytes;
}

std::optional<BagOfWords> unpack(std::span<const std::uint8_t> bytes) {
  BagOfWords bag;
  std::uint64_t next = 0;
  while (!bytes.empty()) {
    const std::optional<std::uint64_t> number = take_number(bytes);
    if (!number || bag.size() == kMaxBagWords) return std::nullopt;
    const std::uint64_t word = next + *number / 2;
    std::uint64_t count = 1;
    if (*number % 2 == 1) {
      const std::optional<std::uint64_t> beyond_two = take_number(bytes);
      if (!beyond_two) return std::nullopt;
      count = *beyond_two + 2;
    }
    if (word > kMax32 || count > kMax32) return std::nullopt;
    bag.push_back({static_cast<std::uint32_t>(word), static_cast<std::uint32_t>(count)});
    next = word + 1;
  }
  return bag;
}

Codec<KeyframeBow>::Encoded Codec<KeyframeBow>::encode(const KeyframeBow& message) {
  Encoded encoded;
  encoded.words = pack(message.words);
  Wire& wire = encoded.wire;
  wire.keyframe = {.robot = message.id.robot, .index = message.id.index};
  wire.stamp = message.stamp;
  wire.vocabulary = message.vocabulary;
  borrow(wire.words, encoded.words);
  return encoded;
}

Decoded<KeyframeBow> Codec<KeyframeBow>::decode(const Wire& wire) {
  if (wire.keyframe.robot != wire.header.robot)
    return Decoded<KeyframeBow>::refuse("a keyframe of another robot than the writer");
  const auto packed = elements_of(wire.words, kMaxPackedBytes);
  if (!packed) return Decoded<KeyframeBow>::refuse("words are missing or too many");
  std::optional<BagOfWords> words = unpack(*packed);
  if (!words) return Decoded<KeyframeBow>::refuse("the words cannot be decoded");
  return Decoded<KeyframeBow>::accept({.id = {wire.keyframe.robot, wire.keyframe.index},
                                       .stamp = wire.stamp,
                                       .vocabulary = wire.vocabulary,
                                       .words = *std::move(words)});
}

}  // namespace km
