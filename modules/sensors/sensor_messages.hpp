#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/recordings/bag_reader.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/sensors/image_file.hpp"

namespace km {

/// True for sensor_msgs/Image and sensor_msgs/CompressedImage, of ROS 1 or 2.
[[nodiscard]] bool has_images(const BagChannel& channel);

/// The type of the messages on a topic of images, by the name that image_transport gives it.
[[nodiscard]] std::string_view type_of_images(std::string_view topic);

/// The grey values of an image message. Encodings: mono8, mono16 (see upper_bits()), bgr8, rgb8,
/// bgra8, rgba8, bayer_*8, yuv422 (UYVY), yuv422_yuy2, OpenCV's 8UC1, 8UC3, 8UC4 and 16UC1, and
/// compressed images (PNG or JPEG). kUnreadable: not such a message;
/// kWrongFormat: another encoding. `place` begins the problem.
[[nodiscard]] ImageResult gray_of_message(const BagChannel& channel, const BagMessage& message,
                                          const std::string& place, const cv::Size& size);

/// The colours of an image; 0 x 0 for a message without colours or that cannot be decoded.
[[nodiscard]] ColorImage color_of_message(const BagChannel& channel, const BagMessage& message,
                                          const cv::Size& size);

/// Depth from a message: 16UC1, mono16 or a PNG image of 16 bits in units of `scale_m` [m], or
/// 32FC1 in metres. image_transport's compressedDepth of 16UC1 or 32FC1 is read as PNG or RVL.
[[nodiscard]] DepthResult depth_of_message(const BagChannel& channel, const BagMessage& message,
                                           const std::string& place, const cv::Size& size,
                                           double scale_m, const DepthRange& range);

/// Topics of a robot's sensors. There is either `imu`, or `gyro` and `accel` with their own stamps
/// (see ImuJoiner), all of type sensor_msgs/Imu. Without `right` the rig is an RGB-D rig. With
/// `odometry`, the nav_msgs/Odometry of an external odometry, no inertial sensor is needed.
struct SensorTopicNames {
  std::string left, right, depth;
  std::string imu, gyro, accel;
  std::string odometry = {};
};

/// Sensor whose messages a robot reads.
enum class SensorRole { kLeft, kRight, kDepth, kImu, kGyro, kAccel, kOdometry };

/// Messages of a sensor.
struct SensorKind {
  SensorRole role;
  std::string SensorTopicNames::*topic;
  std::string_view type;     ///< Type of the messages in ROS 1; empty: images, see has_images().
  std::string_view content;  ///< Name of the content, for texts to users.
  int queue_size;            ///< Live messages that wait to be read, before the oldest is dropped.
};

/// All kinds, in the order of SensorRole.
inline constexpr std::array<SensorKind, 7> kSensorKinds{{
    {SensorRole::kLeft, &SensorTopicNames::left, "", "images", 10},
    {SensorRole::kRight, &SensorTopicNames::right, "", "images", 10},
    {SensorRole::kDepth, &SensorTopicNames::depth, "", "images", 10},
    {SensorRole::kImu, &SensorTopicNames::imu, RosImu::kType, "inertial samples", 4000},
    {SensorRole::kGyro, &SensorTopicNames::gyro, RosImu::kType, "inertial samples", 4000},
    {SensorRole::kAccel, &SensorTopicNames::accel, RosImu::kType, "inertial samples", 4000},
    {SensorRole::kOdometry, &SensorTopicNames::odometry, RosOdometry::kType, "odometry", 4000},
}};

/// True if messages of the channel can be those of the sensor.
[[nodiscard]] bool is_of_kind(const BagChannel& channel, const SensorKind& kind);

/// A topic that is read, with the type of its messages.
struct SensorTopic {
  const SensorKind* kind;
  std::string topic;
  std::string_view type;
};

/// The topics that have a name, in the order of kSensorKinds.
[[nodiscard]] std::vector<SensorTopic> sensor_topics(const SensorTopicNames& names);

}  // namespace km
