#pragma once

#include <zlib.h>

#include <cstdint>

#include "modules/core/io/bytes.hpp"
#include "test/modules/recordings/bag_contents.hpp"

namespace km {

/// Number of messages, and the sum over them of CRC-32 of topic, log time and bytes: what another
/// program makes of a file in a few lines, whatever its order.
struct ListedSum {
  std::size_t messages = 0;
  std::uint64_t sum = 0;

  bool operator==(const ListedSum&) const = default;
};

inline ListedSum sum_of(BagReader& reader) {
  ListedSum result;
  for (const TopicMessage& message : topic_messages_of(reader)) {
    ByteWriter text;
    text.bytes(std::vector<std::uint8_t>(message.topic.begin(), message.topic.end()));
    text.u64(static_cast<std::uint64_t>(message.log_time));
    text.bytes(message.bytes);
    const auto bytes = text.release();
    ++result.messages;
    result.sum += crc32_z(0, bytes.data(), bytes.size());
  }
  return result;
}

}  // namespace km
