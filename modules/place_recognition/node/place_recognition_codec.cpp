#include "modules/place_recognition/node/place_recognition_codec.hpp"

#include <utility>

namespace km {
namespace {

constexpr std::size_t kMaxPackedBytes = 16 * kMaxBagWords;  // two 64-bit numbers per word
constexpr float kMaxScore = 1.001F;                         // 1, and its rounding

}  // namespace

MessageKey Codec<KeyframeBow>::key_of(const KeyframeBow& message) {
  return message_key({message.id.index});
}

Codec<KeyframeBow>::Encoded Codec<KeyframeBow>::encode(const KeyframeBow& message) {
  Encoded encoded;
  encoded.bag = pack(message.words);
  Wire& wire = encoded.wire;
  wire.keyframe = {.robot = message.id.robot, .index = message.id.index};
  wire.stamp = message.stamp;
  wire.vocabulary = message.vocabulary;
  borrow(wire.bag, encoded.bag);
  wire.normalizer = static_cast<float>(message.normalizer);
  return encoded;
}

Decoded<KeyframeBow> Codec<KeyframeBow>::decode(const Wire& wire, const TeamPeer& writer) {
  if (wire.keyframe.robot != writer.robot)
    return Decoded<KeyframeBow>::refuse("a keyframe of another robot than the writer");
  const auto packed = elements_of(wire.bag, kMaxPackedBytes);
  if (!packed) return Decoded<KeyframeBow>::refuse("words are missing or too many");
  std::optional<BagOfWords> words = unpack(*packed);
  if (!words) return Decoded<KeyframeBow>::refuse("the words cannot be decoded");
  if (!(wire.normalizer >= 0.0F && wire.normalizer <= kMaxScore))
    return Decoded<KeyframeBow>::refuse("the normaliser is no score");
  return Decoded<KeyframeBow>::accept({.id = {wire.keyframe.robot, wire.keyframe.index},
                                       .stamp = wire.stamp,
                                       .vocabulary = wire.vocabulary,
                                       .words = *std::move(words),
                                       .normalizer = double{wire.normalizer}});
}

}  // namespace km
