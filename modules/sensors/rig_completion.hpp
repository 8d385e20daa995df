#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/recordings/bag_summary.hpp"
#include "modules/recordings/ros_camera.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/sensors/bag_dataset.hpp"

namespace km {

/// Frames with constant relative poses, from /tf_static. A name with a leading slash, as in ROS 1,
/// equals the name without it.
class StaticTransforms {
 public:
  /// A later transform of a frame replaces the former one. A transform that is not rigid is
  /// skipped.
  void add(const RosTFMessage& message);

  /// T_a_b through any number of frames, in either direction; nullopt if no chain joins them.
  [[nodiscard]] std::optional<SE3> find(const std::string& a, const std::string& b) const;

  /// "base_link, cam0, imu", or "none".
  [[nodiscard]] std::string frames() const;

 private:
  std::map<std::string, std::map<std::string, SE3>> T_a_b_;  // [a][b] and [b][a]
};

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

/// A rig that messages complete. sensor_msgs/CameraInfo contains the cameras and, with a stereo
/// calibration, the relative pose of the two cameras. /tf_static contains the poses of the cameras
/// on the body. Messages also show whether depth is aligned with the left images.
struct PartialRig {
  Rig rig;
  bool has_cameras = true;          ///< The rig has its cameras.
  bool has_extrinsics = true;       ///< False: T_body_cam are poses in the left camera's frame.
  bool has_pair = true;             ///< The relative pose of the cameras is known.
  bool is_depth_aligned = false;    ///< Messages need not show that depth is aligned.
  double virtual_baseline_m = 0.1;  ///< Used for an RGB-D rig, see rgbd_rig().
  /// Topics of CameraInfo of the left and the right camera. The right topic is used only if there
  /// is a topic of right images.
  std::array<std::string, 2> info_topics;
  std::array<RosImages, 2> images = {RosImages::kRaw, RosImages::kRaw};
  std::string depth_info_topic = {};  ///< Topic of CameraInfo of the depth images.
  /// Frame of the inertial sensor. Empty: the frame in its messages, or the odometry's child frame
  /// if there is no inertial sensor.
  std::string body_frame;
  /// Correction of the complete rig, see CameraCalibration; not applied here.
  SE3 T_body_rig = SE3::Identity();
  std::filesystem::path pose_file;  ///< Poses of an external odometry, see PoseFileReader.

  [[nodiscard]] bool checks_depth() const { return !rig.topics.depth.empty() && !is_depth_aligned; }
  [[nodiscard]] bool is_complete() const {
    return has_cameras && has_extrinsics && !checks_depth();
  }
};

/// Completes a rig from messages in any order.
class RigCompletion {
 public:
  explicit RigCompletion(PartialRig rig);

  /// A topic that can supply a missing part, with the type of its messages.
  struct Source {
    std::string topic;
    std::string_view type;
    bool is_needed = true;  ///< False: another topic may supply the same part.
  };
  [[nodiscard]] std::vector<Source> sources() const;

  /// True if the message supplies a new part. Throws DatasetError with topic and value for a
  /// CameraInfo that is not a calibration.
  bool add(const BagChannel& channel, const BagMessage& message);

  /// No further message will arrive. Poses that /tf_static lacks are then taken from /tf.
  void end();

  /// Takes poses from /tf at once, because the recording has no /tf_static.
  void use_moving_transforms() { uses_moving_ = true; }

  /// The complete rig; nullopt while a part is missing(). Throws DatasetError for cameras that are
  /// not a pair, and for depth that is not aligned.
  [[nodiscard]] std::optional<Rig> rig() const;

  /// The missing parts and the topics that could supply them; "" if nothing is missing.
  [[nodiscard]] std::string missing() const;

 private:
  [[nodiscard]] bool has_right() const { return !partial_.rig.topics.right.empty(); }
  [[nodiscard]] const std::string& body_topic() const;
  bool take_part(const BagChannel& channel, const BagMessage& message);
  bool take_info(std::size_t camera, const BagChannel& channel, const BagMessage& message);
  /// Frame of the left or the right camera; nullopt until a message has supplied it.
  [[nodiscard]] std::optional<std::string> camera_frame(std::size_t camera) const;
  [[nodiscard]] std::optional<std::string> body_frame() const;
  [[nodiscard]] std::optional<SE3> find(const std::string& a, const std::string& b) const;
  [[nodiscard]] std::optional<SE3> T_body_left() const;
  [[nodiscard]] std::optional<SE3> T_left_right() const;
  [[nodiscard]] std::string missing_chain(const std::string& a, const std::string& b) const;

  PartialRig partial_;
  std::array<std::optional<RosCameraInfo>, 2> infos_;
  std::optional<std::string> image_frame_, body_frame_;
  StaticTransforms transforms_, moving_;  // those of /tf_static; those of both topics
  bool uses_moving_ = false;
  std::optional<DepthAlignment> alignment_;
};

/// Reads messages until they have completed `rig`. `name`: path of the bag, with which messages
/// begin. At the end of the bag throws DatasetError with all missing parts and the topics that
/// could supply them.
[[nodiscard]] Rig complete_rig(const std::string& name, BagReader& bag, PartialRig rig);

}  // namespace km
