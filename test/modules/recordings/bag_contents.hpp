#pragma once

#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "modules/recordings/bag_reader.hpp"

namespace km {

/// The messages that are left in a recording.
inline std::vector<BagMessage> messages_of(BagReader& reader) {
  std::vector<BagMessage> messages;
  while (auto message = reader.next()) messages.push_back(*std::move(message));
  return messages;
}

inline void check_order(const std::vector<BagMessage>& messages) {
  CHECK(std::ranges::is_sorted(messages, {}, &BagMessage::log_time));
}

/// A message with the topic and type of its channel.
struct TopicMessage {
  std::string topic, type, encoding;
  Stamp log_time = 0;
  std::vector<std::uint8_t> bytes;

  bool operator==(const TopicMessage&) const = default;
};

inline std::vector<TopicMessage> topic_messages_of(BagReader& reader) {
  std::vector<TopicMessage> messages;
  for (BagMessage& message : messages_of(reader)) {
    const BagChannel& channel = reader.channels().at(message.channel);
    messages.push_back({channel.topic, channel.type, channel.encoding, message.log_time,
                        std::move(message.bytes)});
  }
  return messages;
}

}  // namespace km
