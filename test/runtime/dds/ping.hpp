#pragma once

#include <cstdint>
#include <vector>

#include "ping.h"
#include "runtime/dds/codec.hpp"
#include "runtime/dds/wire_sequence.hpp"

namespace km {

/// A message for tests of the transport: `index` is its key.
struct Ping {
  std::uint16_t robot = 0;
  std::uint32_t index = 0;
  std::vector<std::uint8_t> payload;
};

template <>
struct Codec<Ping> {
  using Wire = km_wire_Ping;
  static constexpr const char* kTopic = "pings";
  static constexpr std::uint16_t kVersion = 1;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_Ping_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<std::uint8_t> payload;
  };
  static Encoded encode(const Ping& ping) {
    Encoded encoded;
    encoded.payload = ping.payload;
    encoded.wire.robot = ping.robot;
    encoded.wire.index = ping.index;
    borrow(encoded.wire.payload, encoded.payload);
    return encoded;
  }
  /// Refuses payloads that start with 0xFF.
  static Decoded<Ping> decode(const Wire& wire) {
    const std::uint8_t* data = wire.payload._buffer;
    const std::uint32_t size = wire.payload._length;
    if (size > 0 && data[0] == 0xFF) return Decoded<Ping>::refuse("payload starts with 0xFF");
    return Decoded<Ping>::accept({wire.robot, wire.index, {data, data + size}});
  }
};

}  // namespace km
