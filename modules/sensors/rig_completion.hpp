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
#include "modules/sensors/static_transforms.hpp"

namespace km {

/// A rig of which messages tell the rest: sensor_msgs/CameraInfo the cameras and, where it has a
/// stereo calibration, the right one's place; /tf_static where they are on the body.
struct PartialRig {
  Rig rig;
  bool has_cameras = true;          ///< Of the rig's sensors.
  bool is_placed = true;            ///< Else T_body_cam are poses in the left camera's frame.
  double virtual_baseline_m = 0.1;  ///< Of an RGB-D rig, see rgbd_rig().
  /// Of the left and the right camera; the latter is not used without its topic of images.
  std::array<std::string, 2> info_topics;
  std::array<RosImages, 2> images = {RosImages::kRaw, RosImages::kRaw};
  /// The inertial sensor's; empty: that of its messages, or the odometry's child frame where there
  /// is no inertial sensor.
  std::string body_frame;
  /// Of the complete rig, see CameraCalibration; not applied here.
  SE3 T_body_rig = SE3::Identity();
  std::filesystem::path pose_file;  ///< Of an odometry from outside, see read_pose_file().

  [[nodiscard]] bool is_complete() const { return has_cameras && is_placed; }
};

/// Completes a rig from messages, whichever come first.
class RigCompletion {
 public:
  explicit RigCompletion(PartialRig rig) : partial_(std::move(rig)) {}

  /// Topics that tell something, by the type of their messages.
  struct Teller {
    std::string topic;
    std::string_view type;
    bool is_needed = true;  ///< False: another topic may tell the same.
  };
  [[nodiscard]] std::vector<Teller> tellers() const;

  /// True if it tells something new. Throws DatasetError, naming topic and value, for a CameraInfo
  /// that is no calibration.
  bool add(const BagChannel& channel, const BagMessage& message);

  /// nullopt as long as something is missing(). Throws DatasetError for cameras that are no pair.
  [[nodiscard]] std::optional<Rig> rig() const;

  /// What is, and which topics would tell it; "" if nothing is.
  [[nodiscard]] std::string missing() const;

 private:
  [[nodiscard]] bool has_right() const { return !partial_.rig.topics.right.empty(); }
  [[nodiscard]] const std::string& body_topic() const;
  bool take_info(std::size_t camera, const BagChannel& channel, const BagMessage& message);
  /// Of the left or the right camera; nullopt as long as no message has told it.
  [[nodiscard]] std::optional<std::string> camera_frame(std::size_t camera) const;
  [[nodiscard]] std::optional<std::string> body_frame() const;
  [[nodiscard]] std::optional<SE3> T_body_left() const;
  [[nodiscard]] std::optional<SE3> T_left_right() const;
  [[nodiscard]] std::string missing_chain(const std::string& a, const std::string& b) const;

  PartialRig partial_;
  std::array<std::optional<RosCameraInfo>, 2> infos_;
  std::optional<std::string> image_frame_, body_frame_;
  StaticTransforms transforms_;
};

/// Reads messages until they have completed `rig`. `name` begins messages: the path of the bag.
/// Throws DatasetError at the end of the bag, naming all that is missing and what would tell it.
[[nodiscard]] Rig complete_rig(const std::string& name, BagReader& bag, PartialRig rig);

}  // namespace km
