#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "runtime/ros/ros_network.hpp"

struct ddsi_serdata;

namespace km {

struct SerializedDeleter {
  void operator()(ddsi_serdata* serialized) const;
};

/// Publishes messages that are already encoded (see encode_ros()) on one topic of ROS 2.
/// Thread-safe.
class RosPublisher {
 public:
  /// `depth`: number of messages kept for late readers with RosQos::kLatched.
  RosPublisher(std::shared_ptr<const RosNetwork> network, const std::string& topic,
               std::string_view type, RosQos qos, int depth);

  /// Publishes little-endian CDR with its encapsulation header. Throws DdsError for other bytes.
  void publish(std::span<const std::uint8_t> bytes) const;

  /// Number of matched readers.
  [[nodiscard]] std::size_t reader_count() const;

 private:
  std::shared_ptr<const RosNetwork> network_;  // outlives the members below
  std::string name_;
  DdsEntity topic_, writer_;
  std::unique_ptr<ddsi_serdata, SerializedDeleter> blank_;  // an empty message with the type that
                                                            // DDS needs for raw bytes
};

}  // namespace km
