#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "modules/core/decoded.hpp"
#include "modules/core/stamp.hpp"
#include "modules/recordings/bag_reader.hpp"

namespace km {

/// Messages of ROS with all their fields. Units and frames are those of ROS (SI, REP 103). Decoding
/// does not check the values. kType is the name of the type in ROS 1. Matrices are row-major.

/// std_msgs/Header, with which most messages begin.
struct RosHeader {
  static constexpr std::string_view kType = "std_msgs/Header";
  Stamp stamp = 0;
  std::string frame;
};

struct RosImage {
  static constexpr std::string_view kType = "sensor_msgs/Image";
  RosHeader header;
  std::uint32_t height = 0;  ///< [px]
  std::uint32_t width = 0;   ///< [px]
  std::string encoding;      ///< "mono8", "bgr8", "16UC1", ...
  bool is_bigendian = false;
  std::uint32_t step = 0;          ///< Length of a row [bytes].
  std::vector<std::uint8_t> data;  ///< Pixels: at least height * step bytes.
};

struct RosCompressedImage {
  static constexpr std::string_view kType = "sensor_msgs/CompressedImage";
  RosHeader header;
  std::string format;              ///< "jpeg", "rgb8; jpeg compressed bgr8", ...
  std::vector<std::uint8_t> data;  ///< An image file.
};

struct RosImu {
  static constexpr std::string_view kType = "sensor_msgs/Imu";
  RosHeader header;
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  std::array<double, 9> orientation_covariance{};              ///< First entry -1: no orientation.
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s]
  std::array<double, 9> angular_velocity_covariance{};
  Eigen::Vector3d linear_acceleration = Eigen::Vector3d::Zero();  ///< [m/s^2]
  std::array<double, 9> linear_acceleration_covariance{};
};

struct RosCameraInfo {
  static constexpr std::string_view kType = "sensor_msgs/CameraInfo";
  RosHeader header;
  std::uint32_t height = 0;      ///< [px]
  std::uint32_t width = 0;       ///< [px]
  std::string distortion_model;  ///< "plumb_bob", "equidistant", ...
  std::vector<double> D;
  std::array<double, 9> K{};                   ///< 3x3.
  std::array<double, 9> R{};                   ///< 3x3.
  std::array<double, 12> P{};                  ///< 3x4.
  std::uint32_t binning_x = 0, binning_y = 0;  ///< Pixels combined into one; 0 means 1.
  struct Region {
    std::uint32_t x_offset = 0, y_offset = 0, height = 0, width = 0;  ///< [px]; 0: all.
    bool do_rectify = false;
  } region;  ///< Part of the camera that the images show.
};

/// geometry_msgs/Pose, and Transform, which has the same fields.
struct RosPose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
};

struct RosPoseStamped {
  static constexpr std::string_view kType = "geometry_msgs/PoseStamped";
  RosHeader header;
  RosPose pose;
};

struct RosPoseWithCovarianceStamped {
  static constexpr std::string_view kType = "geometry_msgs/PoseWithCovarianceStamped";
  RosHeader header;
  RosPose pose;
  /// Covariance of [position; rotation about fixed axes], row by row, along the axes of the
  /// header's frame.
  std::array<double, 36> covariance{};
};

struct RosPath {
  static constexpr std::string_view kType = "nav_msgs/Path";
  RosHeader header;
  std::vector<RosPoseStamped> poses;
};

struct RosOccupancyGrid {
  static constexpr std::string_view kType = "nav_msgs/OccupancyGrid";
  RosHeader header;
  Stamp map_load_time = 0;
  float resolution = 0.0F;   ///< Side of a cell [m].
  std::uint32_t width = 0;   ///< Number of cells along x.
  std::uint32_t height = 0;  ///< Number of cells along y.
  RosPose origin;            ///< Pose of the corner of cell (0, 0).
  /// Row-major from cell (0, 0), x first. The bits of int8: 0 free to 100 occupied, -1 unknown.
  std::vector<std::uint8_t> data;
};

struct RosOdometry {
  static constexpr std::string_view kType = "nav_msgs/Odometry";
  RosHeader header;
  std::string child_frame;
  RosPose pose;  ///< Pose of the child frame in the header's frame.
  std::array<double, 36> pose_covariance{};
  Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();   ///< In the child frame [m/s].
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< In the child frame [rad/s].
  std::array<double, 36> twist_covariance{};
};

struct RosTransform {
  static constexpr std::string_view kType = "geometry_msgs/TransformStamped";
  RosHeader header;
  std::string child_frame;
  RosPose pose;  ///< Pose of the child frame in the header's frame.
};

struct RosNavSatFix {
  static constexpr std::string_view kType = "sensor_msgs/NavSatFix";
  static constexpr std::uint8_t kUnknown = 0;  ///< Value of covariance_type.
  RosHeader header;
  std::int8_t status = 0;                       ///< Negative: no position.
  std::uint16_t service = 0;                    ///< Bits of the satellite systems.
  double latitude = 0.0;                        ///< [deg]
  double longitude = 0.0;                       ///< [deg]
  double altitude = 0.0;                        ///< Above the ellipsoid of WGS 84 [m].
  std::array<double, 9> position_covariance{};  ///< 3x3, of east, north, up [m^2].
  std::uint8_t covariance_type = kUnknown;
};

struct RosTransforms {
  static constexpr std::string_view kType = "tf2_msgs/TFMessage";
  std::vector<RosTransform> transforms;
};

struct RosPointCloud {
  static constexpr std::string_view kType = "sensor_msgs/PointCloud2";
  static constexpr std::uint8_t kFloat32 = 7;  ///< Value of Field::datatype.
  struct Field {
    std::string name;           ///< "x", "rgb", ...
    std::uint32_t offset = 0;   ///< Position in a point [bytes].
    std::uint8_t datatype = 0;  ///< kFloat32, ...
    std::uint32_t count = 1;
  };
  RosHeader header;
  std::uint32_t height = 0;  ///< Number of rows; 1 for points without order.
  std::uint32_t width = 0;
  std::vector<Field> fields;
  bool is_bigendian = false;
  std::uint32_t point_step = 0;  ///< Length of a point [bytes].
  std::uint32_t row_step = 0;    ///< Length of a row of points [bytes].
  std::vector<std::uint8_t> data;
  bool is_dense = false;  ///< True if no point is invalid.
};

/// diagnostic_msgs/DiagnosticStatus.
struct RosDiagnosticStatus {
  static constexpr std::uint8_t kOk = 0, kWarn = 1, kError = 2;
  struct KeyValue {
    std::string key, value;
  };
  std::uint8_t level = kOk;
  std::string name, message, hardware_id;
  std::vector<KeyValue> values;
};

struct RosDiagnostics {
  static constexpr std::string_view kType = "diagnostic_msgs/DiagnosticArray";
  RosHeader header;
  std::vector<RosDiagnosticStatus> status;
};

/// visualization_msgs/Marker, as of ROS 2 Humble, without textures and mesh files.
struct RosMarker {
  static constexpr std::string_view kType = "visualization_msgs/Marker";
  /// Types of markers: boxes, line segments of 2 points each, text that faces the viewer, and
  /// triangles of 3 points each.
  static constexpr std::int32_t kCube = 1, kLineList = 5, kText = 9, kTriangleList = 11;
  static constexpr std::int32_t kDelete = 2;  ///< Deletes the marker with this name space and id.
  static constexpr std::int32_t kDeleteAll = 3;  ///< Deletes all markers of the topic.
  RosHeader header;
  std::string name_space;  ///< Name space of `id`. A marker replaces that with equal name space and
                           ///< id.
  std::int32_t id = 0;
  std::int32_t type = 0;
  std::int32_t action = 0;  ///< 0: add or replace, kDelete or kDeleteAll.
  RosPose pose;             ///< Pose of the points in the header's frame.
  Eigen::Vector3d scale =
      Eigen::Vector3d::Ones();  ///< Sides of a cube, width x of lines, height z of text [m].
  Eigen::Vector4f color = {1, 1, 1, 1};     ///< Red, green, blue, alpha: 0 to 1.
  std::array<std::uint32_t, 2> lifetime{};  ///< [s], [ns]; 0: no limit.
  bool frame_locked = false;
  std::vector<Eigen::Vector3d> points;  ///< [m]
  std::vector<Eigen::Vector4f> colors;  ///< One colour per point, or empty.
  std::string text;
};

struct RosMarkers {
  static constexpr std::string_view kType = "visualization_msgs/MarkerArray";
  std::vector<RosMarker> markers;
};

/// A message of a log.
struct RosLog {
  static constexpr std::string_view kType = "rcl_interfaces/Log";
  static constexpr std::uint8_t kDebug = 10, kInfo = 20, kWarn = 30, kError = 40;
  Stamp stamp = 0;
  std::uint8_t level = kInfo;
  std::string name, text, file, function;
  std::uint32_t line = 0;
};

/// True if the messages of the channel have `type`, a name of ROS 1. The name in ROS 2, which
/// contains "/msg/", also matches.
[[nodiscard]] bool is_of_type(const BagChannel& channel, std::string_view type);

/// Decodes a message of a type of this file from the encoding of its channel, "ros1" or "cdr".
/// Refuses bytes that are too short or too long, and images with fewer pixels than they state. A
/// RosHeader is read from the beginning of any message that has one.
template <typename Message>
Decoded<Message> decode_ros(std::string_view encoding, std::span<const std::uint8_t> bytes);
template <>
Decoded<RosHeader> decode_ros(std::string_view encoding, std::span<const std::uint8_t> bytes);

/// Encodes a message as ROS 2 does: little-endian CDR with the encapsulation header.
template <typename Message>
[[nodiscard]] std::vector<std::uint8_t> encode_ros(const Message& message);

}  // namespace km
