#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "runtime/dds/entity.hpp"
#include "runtime/ros/ros_config.hpp"

namespace km {

/// Kinds of quality of service that ROS has for its topics.
enum class RosQos {
  kSensorData,  ///< Best effort: lost samples are not retransmitted.
  kReliable,
  kLatched,  ///< Reliable, and the last message is kept for late readers.
};

/// A participant in the network of ROS 2. Like rmw_cyclonedds_cpp and rmw_fastrtps_cpp it names
/// topics "rt/..." and types "sensor_msgs::msg::dds_::Imu_". It shares nothing with the domain of
/// the team, which may have the same number.
class RosNetwork {
 public:
  /// Throws ConfigError for an unusable `config`, DdsError if DDS refuses it.
  explicit RosNetwork(const RosConfig& config);

  [[nodiscard]] dds_entity_t participant() const { return participant_.handle(); }
  [[nodiscard]] const std::string& interface() const { return interface_; }
  /// ROS_DOMAIN_ID.
  [[nodiscard]] int domain() const { return ros_domain_; }

  /// DDS descriptor of a message type, named as in ROS 1 or ROS 2: "sensor_msgs/Image",
  /// "sensor_msgs/msg/Image". Throws std::invalid_argument for types outside known_ros_types().
  [[nodiscard]] static const dds_topic_descriptor_t& descriptor_of(std::string_view type);

  /// A DDS topic for ROS' `topic`. Throws DdsError and std::invalid_argument for an unknown type.
  [[nodiscard]] DdsEntity create_topic(std::string_view topic, std::string_view type) const;

 private:
  int ros_domain_;
  std::string interface_;
  DdsEntity domain_;
  DdsEntity participant_;
};

/// The types of messages that a RosNetwork knows: "sensor_msgs/msg/Image", ...
[[nodiscard]] std::vector<std::string> known_ros_types();

/// `depth`: messages kept until they are taken.
[[nodiscard]] DdsQos ros_qos(RosQos kind, int depth);

}  // namespace km
