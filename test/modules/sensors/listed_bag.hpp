#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "modules/recordings/bag_reader.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

/// An image of one grey level.
inline RosImage mono_image(RosHeader header, std::uint32_t width, std::uint32_t height,
                           std::uint8_t grey = 0) {
  return {.header = std::move(header),
          .height = height,
          .width = width,
          .encoding = "mono8",
          .is_bigendian = 0,
          .step = width,
          .data = std::vector<std::uint8_t>(std::size_t{width} * height, grey)};
}

/// The CameraInfo of a camera with distortion; `Tx` is that of P for the right one of a pair.
inline RosCameraInfo camera_info(const std::string& frame, double Tx = 0.0) {
  RosCameraInfo info;
  info.header.frame_id = frame;
  info.width = 640;
  info.height = 480;
  info.distortion_model = "plumb_bob";
  info.d = {-0.28, 0.07, 2e-4, 1e-5, 0.0};
  info.k = {458.0, 0, 320.5, 0, 457.0, 240.5, 0, 0, 1};
  info.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.p = {430.0, 0, 318.0, Tx, 0, 430.0, 239.0, 0, 0, 0, 1, 0};
  return info;
}

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
