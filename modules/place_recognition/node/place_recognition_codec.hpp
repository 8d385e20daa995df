#pragma once

#include <place_recognition.h>

#include <cstdint>
#include <vector>

#include "modules/place_recognition/packed_bag.hpp"
#include "runtime/dds/codec.hpp"

namespace km {

template <>
struct Codec<KeyframeBow> : WireFormat<km_wire_BagOfWords, km_wire_BagOfWords_desc> {
  static constexpr const char* kTopic = "bags_of_words";
  static constexpr std::size_t kMaxBytes = 1U << 18U;

  struct Encoded {
    Wire wire{};
    std::vector<std::uint8_t> bag;
  };
  static MessageKey key_of(const KeyframeBow& message);
  static Encoded encode(const KeyframeBow& message);
  static Decoded<KeyframeBow> decode(const Wire& wire, const TeamPeer& writer);
};

}  // namespace km
