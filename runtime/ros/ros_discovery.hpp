#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "runtime/ros/ros_network.hpp"

namespace km {

/// A publisher of a ROS 2 topic.
struct TopicPublisher {
  std::string topic;           ///< Name in ROS: "/imu0".
  std::string type;            ///< "sensor_msgs/msg/Imu"
  std::uint64_t instance = 0;  ///< Its handle in DDS.
};

/// Why no message of a topic arrives, by the programs that publish.
struct Silence {
  const char* kind = "";  ///< "silent", "other_type" or "similar_name".
  std::string why, to_do;
};

/// `is_named`: true for the other topics that this robot reads. The most similar name
/// of a topic with the same kind of messages is proposed.
[[nodiscard]] Silence why_silent(const std::string& topic, const std::string& type,
                                 const std::function<bool(const std::string&)>& is_named,
                                 std::span<const TopicPublisher> publishers);

/// Collects the publishers of ROS topics that DDS discovers from its construction on, as long as
/// they exist. Not thread-safe. `network` outlives it.
class RosDiscovery {
 public:
  explicit RosDiscovery(const RosNetwork& network);

  /// Waits up to `patience_s` [s] for further publishers. True if there are any.
  bool wait(double patience_s);

  /// In the order of their discovery.
  [[nodiscard]] const std::vector<TopicPublisher>& publishers();

 private:
  // True if there is a new publisher.
  [[nodiscard]] bool take();

  DdsEntity reader_, waitset_;
  std::vector<TopicPublisher> publishers_;
};

}  // namespace km
