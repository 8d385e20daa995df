#pragma once

#include "modules/core/camera.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

/// Which images of a camera a topic has. sensor_msgs/CameraInfo is the same beside both.
enum class RosImages {
  kRaw,        ///< image_raw: K and D are theirs, and R turns the camera to the rectified one.
  kRectified,  ///< image_rect: P is theirs. Where D is 0 and R the identity, both are the same.
};

/// The camera of a sensor_msgs/CameraInfo (its documentation defines K, D, R and P), its T_body_cam
/// the identity. Distortion: plumb_bob (4 or 5 coefficients), rational_polynomial (8; further ones,
/// of thin prisms and tilted sensors, must be 0), equidistant or fisheye (4), or none. Throws
/// std::invalid_argument, naming the frame, the field and the value, for K = 0, an uncalibrated
/// camera, for other models, and for what calibration_limits.hpp refuses.
[[nodiscard]] Camera camera_of(const RosCameraInfo& info, RosImages images);

/// The pair of a stereo calibration: the baseline B is that of the right camera's P, whose fourth
/// number is Tx = -fx B, the rotation that of both R. `T_body_left` is the left camera's pose, as
/// its images are: of the rectified camera, if they are rectified. Throws likewise, and for a P
/// without baseline.
[[nodiscard]] StereoRig stereo_of(const RosCameraInfo& left, const RosCameraInfo& right,
                                  RosImages images, const SE3& T_body_left);

}  // namespace km
