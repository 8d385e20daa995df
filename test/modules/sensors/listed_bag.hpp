#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "modules/recordings/bag_reader.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

/// A recording of ROS 2 whose messages a test lists in order of log time.
class ListedBag final : public BagReader {
 public:
  /// `message` is of a type of ros_messages.hpp. Its log time is the stamp of its header plus
  /// `late_s`.
  template <typename Message>
  void add(const std::string& topic, const Message& message, double late_s = 0.0) {
    add_bytes(topic, Message::kType, message.header.stamp + nanoseconds(late_s),
              encode_ros(message));
  }

  /// A channel of a topic, so far without a message; its index.
  std::size_t describe(const std::string& topic, std::string_view type) {
    std::size_t channel = 0;
    while (channel < channels_.size() && channels_[channel].topic != topic) ++channel;
    return channel < channels_.size() ? channel : add_channel(topic, type, "cdr");
  }
  /// One more channel, which may equal an earlier one.
  std::size_t add_channel(const std::string& topic, std::string_view type,
                          const std::string& encoding) {
    channels_.push_back({topic, std::string(type), encoding, 0});
    return channels_.size() - 1;
  }

  void add_bytes(const std::string& topic, std::string_view type, Stamp log_time,
                 std::vector<std::uint8_t> bytes) {
    add_bytes(describe(topic, type), log_time, std::move(bytes));
  }
  void add_bytes(std::size_t channel, Stamp log_time, std::vector<std::uint8_t> bytes) {
    ++channels_[channel].message_count;
    messages_.push_back({channel, log_time, std::move(bytes)});
  }

  [[nodiscard]] const std::vector<BagChannel>& channels() const override { return channels_; }
  [[nodiscard]] std::optional<BagMessage> next() override {
    if (next_ == messages_.size()) return std::nullopt;
    return messages_[next_++];
  }
  [[nodiscard]] BagReport report() const override { return {}; }

 private:
  std::vector<BagChannel> channels_;
  std::vector<BagMessage> messages_;
  std::size_t next_ = 0;
};

}  // namespace km
