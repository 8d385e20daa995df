#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "modules/recordings/bag_reader.hpp"
#include "modules/ros_dds/ros_sink.hpp"
#include "runtime/ros/ros_publisher.hpp"
#include "runtime/ros/ros_subscription.hpp"

namespace km {

/// Live topics of ROS 2 as a recording without end, so that the code that plays recordings also
/// reads the topics of drivers. Not thread-safe, except for stop().
class LiveBag final : public BagReader {
 public:
  LiveBag(std::shared_ptr<const RosNetwork> network, std::vector<RosTopic> topics)
      : subscription_(std::move(network), std::move(topics)) {
    for (const RosTopic& topic : subscription_.topics())
      channels_.push_back({topic.topic, topic.type, "cdr", 0});
  }

  [[nodiscard]] const std::vector<BagChannel>& channels() const override { return channels_; }
  /// Waits for a message. nullopt after stop(), or when the time of give_up_after() has passed.
  [[nodiscard]] std::optional<BagMessage> next() override {
    auto message = subscription_.next();
    if (!message) return std::nullopt;
    return BagMessage{message->topic, message->arrival, std::move(message->bytes)};
  }
  [[nodiscard]] BagReport report() const override {
    BagReport report;
    for (std::size_t topic = 0; topic < channels_.size(); ++topic)
      if (const auto lost = subscription_.lost(topic); lost > 0)
        report.add(BagFault::kLost, channels_[topic].topic, lost);
    return report;
  }
  [[nodiscard]] bool is_live() const override { return true; }
  void stop() noexcept override { subscription_.stop(); }

  /// See RosSubscription::give_up_after().
  void give_up_after(double patience_s) { subscription_.give_up_after(patience_s); }

 private:
  RosSubscription subscription_;
  std::vector<BagChannel> channels_;
};

/// Publishes messages on ROS 2 topics.
class LiveSink final : public RosSink {
 public:
  explicit LiveSink(std::shared_ptr<const RosNetwork> network) : network_(std::move(network)) {}

  /// Throws DdsError, and std::invalid_argument for a type that RosNetwork does not know.
  std::size_t open(const PublishedTopic& topic) override {
    publishers_.push_back(std::make_unique<RosPublisher>(
        network_, topic.name, topic.type, topic.is_state ? RosQos::kLatched : RosQos::kReliable,
        topic.depth));
    return publishers_.size() - 1;
  }
  void put(std::size_t topic, std::optional<Stamp> /*time*/,
           std::span<const std::uint8_t> message) override {
    publishers_.at(topic)->publish(message);
  }

 private:
  std::shared_ptr<const RosNetwork> network_;
  std::vector<std::unique_ptr<RosPublisher>> publishers_;
};

}  // namespace km
