#pragma once

#include "modules/recordings/open_bag.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "test/support/test.hpp"

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

/// An MCAP file with messages of ROS 2, read to its end.
struct Record {
  explicit Record(const fs::path& file)
      : reader(open_mcap(file)), messages(topic_messages_of(*reader)) {
    for (const TopicMessage& message : messages) ++counts[message.topic];
  }
  /// The newest message of a topic; throws std::out_of_range without one.
  template <typename Message>
  [[nodiscard]] Message last(const std::string& topic) const {
    for (std::size_t k = messages.size(); k-- > 0;)
      if (messages[k].topic == topic)
        return decode_ros<Message>("cdr", messages[k].bytes).value.value();
    throw std::out_of_range(topic);
  }
  /// The frames that transforms join: parent and child.
  [[nodiscard]] std::set<std::pair<std::string, std::string>> links() const {
    std::set<std::pair<std::string, std::string>> all;
    for (const TopicMessage& message : messages) {
      if (message.topic != "/tf" && message.topic != "/tf_static") continue;
      const auto transforms = decode_ros<RosTFMessage>("cdr", message.bytes);
      for (const RosTransformStamped& link : transforms.value.value().transforms)
        all.emplace(link.header.frame_id, link.child_frame_id);
    }
    return all;
  }

  const std::unique_ptr<BagReader> reader;
  std::vector<TopicMessage> messages;
  std::map<std::string, std::size_t> counts;
};

}  // namespace km
