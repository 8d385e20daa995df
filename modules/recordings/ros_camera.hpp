#pragma once

#include <optional>

#include "modules/core/camera.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

/// The kind of images on a topic of a camera. Both kinds have the same sensor_msgs/CameraInfo.
enum class RosImages {
  kRaw,        ///< image_raw: K and D describe them, and R rotates the camera to the rectified one.
  kRectified,  ///< image_rect: P describes them. If D is 0 and R the identity, both kinds are
               ///< equal.
};

/// The camera of a sensor_msgs/CameraInfo (its documentation defines K, D, R and P), with the
/// identity as T_body_cam. Distortion: plumb_bob (4 or 5 coefficients), rational_polynomial (8;
/// further ones, of thin prisms and tilted sensors, must be 0), equidistant or fisheye (4), or
/// none. Throws std::invalid_argument that names the frame, the field and the value. It refuses K =
/// 0 (an uncalibrated camera), other models, binned or cropped images, and calibrations that
/// calibration_limits.hpp refuses.
[[nodiscard]] Camera camera_of(const RosCameraInfo& info, RosImages images);

/// Pose of the camera of camera_of() in the frame of the message. That frame is the rectified
/// camera, because P projects points of it. A matrix R of zeros means no rotation. Throws
/// std::invalid_argument if R is no rotation.
[[nodiscard]] SE3 T_frame_camera(const RosCameraInfo& info, RosImages images);

/// Distance of a right camera from the left one by Tx = -fx B, the fourth number of its P [m];
/// nullopt if P contains none.
[[nodiscard]] std::optional<double> baseline_m(const RosCameraInfo& right);

}  // namespace km
