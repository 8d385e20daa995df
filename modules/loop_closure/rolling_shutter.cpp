#include "modules/loop_closure/rolling_shutter.hpp"

#include <Eigen/Geometry>

namespace km {

void unroll(const Camera& camera, double readout_s, const Vector6& twist_body,
            KeyframeFeatures& features) {
  const SE3& T_body_cam = features.T_body_cam;
  const Eigen::Vector3d rate_body = twist_body.head<3>();
  const Eigen::Vector3d velocity_body =
      twist_body.tail<3>() + rate_body.cross(T_body_cam.translation());
  const Eigen::Vector3d rate = T_body_cam.linear().transpose() * rate_body;
  const Eigen::Vector3d velocity = T_body_cam.linear().transpose() * velocity_body;
  for (Keypoint& keypoint : features.keypoints) {
    const Eigen::Vector2d bearing = keypoint.bearing.cast<double>();
    const auto px = camera.project(bearing);
    if (!px) continue;
    const double late_s = readout_s * camera.row_time(px->y());
    const Eigen::Vector3d u =
        -rate.cross(bearing.homogeneous()) - double{keypoint.inverse_depth} * velocity;
    keypoint.bearing -= (late_s * (u.head<2>() - u.z() * bearing)).cast<float>();
    keypoint.inverse_depth *= static_cast<float>(1.0 + late_s * u.z());
  }
}

}  // namespace km
