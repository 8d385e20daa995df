#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "modules/core/decoded.hpp"
#include "modules/core/io/bytes.hpp"
#include "modules/core/stamp.hpp"
#include "modules/recordings/bag_reader.hpp"
#include "modules/recordings/ros_types.hpp"

namespace km {

/// Reads the fields of a ROS message one after the other, in either encoding:
///   "ros1"  ROS 1: little endian, without gaps (wiki.ros.org/msg);
///   "cdr"   ROS 2: OMG's CDR as DDS writes it (DDS-XTypes, XCDR version 1, plain): an
///           encapsulation header of four bytes that states the byte order; numbers lie at
///           multiples of their size after the header.
/// The bytes are untrusted, as for ByteReader: after a read that fails, all values are zero or
/// empty. The bytes must outlive this object.
class RosReader {
 public:
  /// Refuses other encodings, and encapsulations with parameter lists or of XCDR version 2.
  static Decoded<RosReader> open(std::string_view encoding, std::span<const std::uint8_t> bytes);

  /// Reads fields, each by its type: numbers, bool, string, builtin_interfaces/Time [ns] (Stamp),
  /// messages of ros_types.hpp, arrays of constant length (std::array, Eigen) and others
  /// (std::vector).
  template <typename... Fields>
  void operator()(Fields&... fields) {
    (get(fields), ...);
  }

  /// Reason why the bytes do not fit the fields read: too short or too long; null if they fit.
  [[nodiscard]] const char* problem() const;
  [[nodiscard]] bool failed() const { return reader_.failed(); }

 private:
  RosReader(std::span<const std::uint8_t> bytes, bool is_cdr, bool is_big_endian)
      : reader_(bytes), size_(bytes.size()), is_cdr_(is_cdr), is_big_endian_(is_big_endian) {}

  void get(std::uint8_t& value) { value = reader_.u8(); }
  void get(std::int8_t& value) { value = static_cast<std::int8_t>(reader_.u8()); }
  void get(std::uint16_t& value) { value = static_cast<std::uint16_t>(number(2)); }
  void get(bool& value) { value = reader_.u8() != 0; }
  void get(std::uint32_t& value) { value = static_cast<std::uint32_t>(number(4)); }
  void get(std::int32_t& value) { value = static_cast<std::int32_t>(number(4)); }
  void get(float& value) { value = std::bit_cast<float>(static_cast<std::uint32_t>(number(4))); }
  void get(double& value) { value = std::bit_cast<double>(number(8)); }
  void get(std::string& value);
  void get(Stamp& value);
  void get(std::vector<std::uint8_t>& values);
  template <typename T>
  void get(std::vector<T>& values) {
    values.clear();  // grows as far as the bytes reach, whatever number they state
    for (auto left = number(4); left > 0 && !failed(); --left) get(values.emplace_back());
  }
  template <typename T, std::size_t kSize>
  void get(std::array<T, kSize>& values) {
    for (T& value : values) get(value);
  }
  template <typename T, int kSize>
  void get(Eigen::Matrix<T, kSize, 1>& vector) {
    for (T& value : vector) get(value);
  }
  void get(Eigen::Quaterniond& rotation) { get(rotation.coeffs()); }  // x, y, z, w
  template <typename Message>
  requires requires { Message::kType; }
  void get(Message& message) {
    // The sequence number exists only in ROS 1.
    if constexpr (std::is_same_v<Message, RosHeader>)
      if (!is_cdr_) static_cast<void>(number(4));
    Message::visit(*this, message);
    if constexpr (std::is_same_v<Message, RosImage>)
      if (message.data.size() < std::uint64_t{message.step} * message.height) reader_.fail();
  }
  [[nodiscard]] std::uint64_t number(std::size_t size);

  ByteReader reader_;
  std::size_t size_;
  bool is_cdr_;
  bool is_big_endian_;
};

/// Writes the fields of a ROS message as little-endian CDR, with the interface of RosReader.
class RosWriter {
 public:
  template <typename... Fields>
  void operator()(const Fields&... fields) {
    (put(fields), ...);
  }

  /// The bytes with the encapsulation header.
  [[nodiscard]] std::vector<std::uint8_t> release() { return std::move(bytes_); }

 private:
  void put(std::uint8_t value) { bytes_.push_back(value); }
  void put(std::int8_t value) { bytes_.push_back(static_cast<std::uint8_t>(value)); }
  void put(std::uint16_t value) { number(value, 2); }
  void put(bool value) { bytes_.push_back(value ? 1 : 0); }
  void put(std::uint32_t value) { number(value, 4); }
  void put(std::int32_t value) { number(static_cast<std::uint32_t>(value), 4); }
  void put(float value) { number(std::bit_cast<std::uint32_t>(value), 4); }
  void put(double value) { number(std::bit_cast<std::uint64_t>(value), 8); }
  void put(const std::string& value);
  void put(Stamp value);
  void put(const std::vector<std::uint8_t>& values);
  template <typename T>
  void put(const std::vector<T>& values) {
    number(values.size(), 4);
    for (const T& value : values) put(value);
  }
  template <typename T, std::size_t kSize>
  void put(const std::array<T, kSize>& values) {
    for (const T value : values) put(value);
  }
  template <typename T, int kSize>
  void put(const Eigen::Matrix<T, kSize, 1>& vector) {
    for (const T value : vector) put(value);
  }
  void put(const Eigen::Quaterniond& rotation) { put(rotation.coeffs()); }
  template <typename Message>
  requires requires { Message::kType; }
  void put(const Message& message) { Message::visit(*this, message); }
  void number(std::uint64_t value, std::size_t size);

  std::vector<std::uint8_t> bytes_ = {0, 1, 0, 0};
};

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

/// True if the messages of the channel have `type`, a name of ROS 1. Other forms of the name also
/// match, see ros1_name().
[[nodiscard]] bool is_of_type(const BagChannel& channel, std::string_view type);

/// "sensor_msgs/msg/Image" of "sensor_msgs/Image".
[[nodiscard]] std::string ros2_name(std::string_view type);

/// "sensor_msgs/Image" of "sensor_msgs/msg/Image", and of "sensor_msgs::msg::dds_::Image_", the
/// name that recorders of DDS write.
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
