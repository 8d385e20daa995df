#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "modules/recordings/bag_summary.hpp"
#include "modules/recordings/ros_camera.hpp"
#include "modules/sensors/static_transforms.hpp"

namespace km {

/// A topic of images, and the topic of its sensor_msgs/CameraInfo.
struct CameraTopics {
  std::string images, info;
};

/// Decides from messages whether a pixel of the depth image and the same pixel of the left image
/// see the same point. Drivers align depth on request only. Sizes and CameraInfo must be equal, and
/// so must frames, or their poses in /tf_static. Without /tf_static, equal CameraInfo suffices.
class DepthAlignment {
 public:
  /// `images`: kind of the left images.
  DepthAlignment(CameraTopics left, CameraTopics depth, RosImages images)
      : cameras_{{{std::move(left)}, {std::move(depth)}}}, images_(images) {}

  /// True if the message supplies a new part.
  bool add(const BagChannel& channel, const BagMessage& message);

  /// No further message will arrive, so problem() decides with what is known.
  void end() { ended_ = true; }

  /// The difference and its remedy; "" if depth is aligned; nullopt while messages are missing.
  [[nodiscard]] std::optional<std::string> problem(const StaticTransforms& transforms) const;

 private:
  struct Camera {
    CameraTopics topics;
    std::optional<TopicImage> image = {};
    std::optional<RosCameraInfo> info = {};
    std::size_t image_count = 0;
  };

  [[nodiscard]] std::optional<std::string> difference(const StaticTransforms& transforms) const;
  [[nodiscard]] bool waits_for_info() const;
  [[nodiscard]] std::string different_info() const;

  std::array<Camera, 2> cameras_;  // left, depth
  RosImages images_;
  bool ended_ = false;
};

/// Text for users: the topics, the difference between their cameras, and how drivers align depth.
[[nodiscard]] std::string misaligned_text(const std::string& left, const std::string& depth,
                                          const std::string& difference);

/// Differences of size and frame, as misaligned_text() takes them; "" if there are none. Sizes and
/// frames that are unknown do not differ.
[[nodiscard]] std::string different_size(const TopicImage& left, const TopicImage& depth);
[[nodiscard]] std::string different_frame(const TopicImage& left, const TopicImage& depth);

}  // namespace km
