#pragma once

#include <string>
#include <vector>

#include "runtime/dds/ros_network.hpp"

namespace km {

/// A publisher of a ROS 2 topic.
struct TopicPublisher {
  std::string topic;  ///< Name in ROS: "/imu0".
  std::string type;   ///< "sensor_msgs/msg/Imu"
};

/// Collects the publishers of ROS topics that DDS discovers from its construction on. Not
/// thread-safe. `network` outlives it.
class RosDiscovery {
 public:
  explicit RosDiscovery(const RosNetwork& network);

  /// Waits up to `patience_s` [s] for further publishers. True if there are any.
  bool wait(double patience_s);

  /// Every publisher that has been discovered, in this order.
  [[nodiscard]] const std::vector<TopicPublisher>& publishers();

 private:
  void take();

  DdsEntity reader_, waitset_;
  std::vector<TopicPublisher> publishers_;
};

}  // namespace km
