#pragma once

#include <string>
#include <string_view>

namespace km {

/// The definition of a type of ros_messages.hpp that robots tell, by its name in ROS 1, as MCAP's
/// encoding "ros2msg" has it: its fields, then, each below a line of "=" and one that names it,
/// those of all types in it (mcap.dev/spec/registry). Throws std::invalid_argument for others.
[[nodiscard]] std::string ros_definition(std::string_view type);

/// "sensor_msgs/msg/Image" of "sensor_msgs/Image".
[[nodiscard]] std::string ros2_name(std::string_view type);

/// "sensor_msgs/Image" of "sensor_msgs/msg/Image".
[[nodiscard]] std::string ros1_name(std::string_view type);

/// A name as topics and frames may have it: what is neither letter, digit nor underscore is one.
[[nodiscard]] std::string ros_name(std::string name);

}  // namespace km
