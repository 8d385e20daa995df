#pragma once

#include <memory>
#include <vector>

#include "modules/ros_dds/ros_sink.hpp"
#include "runtime/dds/ros_publisher.hpp"

namespace km {

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
  [[nodiscard]] std::size_t readers(std::size_t topic) const override {
    return publishers_.at(topic)->reader_count();
  }

 private:
  std::shared_ptr<const RosNetwork> network_;
  std::vector<std::unique_ptr<RosPublisher>> publishers_;
};

}  // namespace km
