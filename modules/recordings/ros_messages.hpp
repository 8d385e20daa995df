#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "modules/core/decoded.hpp"
#include "modules/recordings/bag_reader.hpp"
#include "modules/recordings/ros_serialization.hpp"
#include "modules/recordings/ros_types.hpp"

namespace km {

/// Values of fields of messages, as ROS' definitions name them.
struct RosLevel {  ///< RosDiagnosticStatus::level.
  static constexpr std::uint8_t kOk = 0, kWarn = 1, kError = 2;
};
struct RosLogLevel {  ///< RosLog::level.
  static constexpr std::uint8_t kDebug = 10, kInfo = 20, kWarn = 30, kError = 40;
};
struct RosMarkerType {  ///< RosMarker::type: line segments have 2 points each, triangles 3.
  static constexpr std::int32_t kCube = 1, kLineList = 5, kText = 9, kTriangleList = 11;
};
struct RosMarkerAction {  ///< RosMarker::action.
  static constexpr std::int32_t kAdd = 0, kDelete = 2, kDeleteAll = 3;
};
inline constexpr std::uint8_t kRosFloat32 = 7;            ///< RosPointField::datatype.
inline constexpr std::uint8_t kRosUnknownCovariance = 0;  ///< position_covariance_type.

/// True if the messages of the channel have `type`, a name of ROS 1. The name in ROS 2, which
/// contains "/msg/", also matches.
[[nodiscard]] bool is_of_type(const BagChannel& channel, std::string_view type);

/// "sensor_msgs/msg/Image" of "sensor_msgs/Image".
[[nodiscard]] std::string ros2_name(std::string_view type);

/// "sensor_msgs/Image" of "sensor_msgs/msg/Image".
[[nodiscard]] std::string ros1_name(std::string_view type);

/// A valid name for topics and frames: underscores replace all characters except for letters,
/// digits and underscores.
[[nodiscard]] std::string ros_name(std::string name);

/// The definition of a type of ros_types.hpp, in MCAP's encoding "ros2msg"
/// (mcap.dev/spec/registry). `type` is its name in ROS 1. The definition consists of the fields of
/// the type and the definitions of the types of these fields. A line of "=" and a line with the
/// name precede each of the latter. Throws std::invalid_argument for other types.
[[nodiscard]] std::string ros_definition(std::string_view type);

/// Decodes a message of a type of ros_types.hpp from the encoding of its channel, "ros1" or "cdr".
/// Refuses bytes that are too short or too long, and images with fewer pixels than they state. A
/// RosHeader is read from the beginning of any message that has one.
template <typename Message>
Decoded<Message> decode_ros(std::string_view encoding, std::span<const std::uint8_t> bytes) {
  auto wire = RosReader::open(encoding, bytes);
  if (!wire.value) return Decoded<Message>::refuse(wire.refusal);
  Message message;
  (*wire.value)(message);
  if constexpr (std::is_same_v<Message, RosHeader>) {
    if (wire.value->failed()) return Decoded<Message>::refuse("a message without a header");
  } else {
    if (const char* const problem = wire.value->problem()) return Decoded<Message>::refuse(problem);
  }
  return Decoded<Message>::accept(std::move(message));
}

/// Encodes a message as ROS 2 does: little-endian CDR with the encapsulation header.
template <typename Message>
[[nodiscard]] std::vector<std::uint8_t> encode_ros(const Message& message) {
  RosWriter wire;
  wire(message);
  return wire.release();
}

}  // namespace km
