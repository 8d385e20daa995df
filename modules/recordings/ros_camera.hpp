#pragma once

#include <optional>

#include "modules/core/camera/camera.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

/// The kind of images on a topic of a camera. Both kinds have the same sensor_msgs/CameraInfo. If D
/// is 0 and R the identity, both kinds are equal.
enum class RosImages {
  kRaw,        ///< image_raw, with K and D; R rotates from the camera to the rectified camera.
  kRectified,  ///< image_rect, with P.
};

/// The camera of a sensor_msgs/CameraInfo (its documentation defines K, D, R and P), with the
/// identity as T_body_cam. Distortion: plumb_bob (4 or 5 coefficients), rational_polynomial (8;
/// further ones, of thin prisms and tilted sensors, must be 0), equidistant or fisheye (4), or
/// none. Throws std::invalid_argument with frame, field and value for K = 0 (P = 0 of
/// rectified images: an uncalibrated camera), other models, binned or cropped images, and
/// calibrations that calibration_limits.hpp refuses.
[[nodiscard]] Camera camera_of(const RosCameraInfo& info, RosImages images);

/// Pose of the camera of camera_of() in the frame of the message. The frame of the message is that
/// of the rectified camera, from which P projects. A matrix R of zeros means no rotation. Throws
/// std::invalid_argument if R is no rotation.
[[nodiscard]] SE3 T_frame_camera(const RosCameraInfo& info, RosImages images);

/// Distance B of a right camera from the left camera, by the fourth number of its P, Tx = -fx B
/// [m]; nullopt if P contains no distance.
[[nodiscard]] std::optional<double> baseline_m(const RosCameraInfo& right);

}  // namespace km
