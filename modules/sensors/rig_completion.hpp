#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "modules/recordings/ros_camera.hpp"
#include "modules/sensors/bag_dataset.hpp"
#include "modules/sensors/depth_alignment.hpp"
#include "modules/sensors/static_transforms.hpp"

namespace km {

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
  std::filesystem::path pose_file;  ///< Poses of an external odometry, see read_pose_file().

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

  /// No further message of depth will arrive.
  void end_depth();

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
  [[nodiscard]] std::optional<SE3> T_body_left() const;
  [[nodiscard]] std::optional<SE3> T_left_right() const;
  [[nodiscard]] std::string missing_chain(const std::string& a, const std::string& b) const;

  PartialRig partial_;
  std::array<std::optional<RosCameraInfo>, 2> infos_;
  std::optional<std::string> image_frame_, body_frame_;
  StaticTransforms transforms_;
  std::optional<DepthAlignment> alignment_;
};

/// Reads messages until they have completed `rig`. `name`: path of the bag, with which messages
/// begin. At the end of the bag throws DatasetError with all missing parts and the topics that
/// could supply them.
[[nodiscard]] Rig complete_rig(const std::string& name, BagReader& bag, PartialRig rig);

}  // namespace km
