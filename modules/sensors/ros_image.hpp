#pragma once

#include <string>
#include <string_view>

#include "modules/core/camera.hpp"
#include "modules/recordings/bag_reader.hpp"
#include "modules/sensors/image_file.hpp"

namespace km {

/// True for sensor_msgs/Image and sensor_msgs/CompressedImage, of ROS 1 or 2.
[[nodiscard]] bool has_images(const BagChannel& channel);

/// The type of the messages on a topic of images, by the name that image_transport gives it.
[[nodiscard]] std::string_view type_of_images(std::string_view topic);

/// The grey values of an image message. Encodings: mono8, mono16 (its higher byte), bgr8, rgb8,
/// bgra8, rgba8, bayer_*8, yuv422 (UYVY), yuv422_yuy2, OpenCV's 8UC1, 8UC3, 8UC4 and 16UC1, and
/// compressed images (PNG or JPEG). kUnreadable: not such a message;
/// kWrongFormat: another encoding. `place` begins the problem.
[[nodiscard]] ImageResult gray_of_message(const BagChannel& channel, const BagMessage& message,
                                          const std::string& place, const cv::Size& size);

/// Depth from a message: 16UC1 or mono16 in units of `scale_m` [m], 32FC1 in metres, or a PNG image
/// of 16 bits, with or without image_transport's header of compressedDepth.
[[nodiscard]] DepthResult depth_of_message(const BagChannel& channel, const BagMessage& message,
                                           const std::string& place, const cv::Size& size,
                                           double scale_m, const DepthRange& range);

}  // namespace km
