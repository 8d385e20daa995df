#pragma once

#include <string>
#include <string_view>

namespace km {

/// The definition of a type that robots write, in MCAP's encoding "ros2msg"
/// (mcap.dev/spec/registry). `type` is its name in ROS 1. The definition consists of the fields of
/// the type and the definitions of the types of these fields. A line of "=" and a line with the
/// name precede each of the latter. Throws std::invalid_argument for other types.
[[nodiscard]] std::string ros_definition(std::string_view type);

/// "sensor_msgs/msg/Image" of "sensor_msgs/Image".
[[nodiscard]] std::string ros2_name(std::string_view type);

/// "sensor_msgs/Image" of "sensor_msgs/msg/Image".
[[nodiscard]] std::string ros1_name(std::string_view type);

/// A valid name for topics and frames: underscores replace all characters except for letters,
/// digits and underscores.
[[nodiscard]] std::string ros_name(std::string name);

}  // namespace km
