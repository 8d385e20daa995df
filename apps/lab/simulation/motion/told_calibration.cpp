#include "apps/lab/simulation/motion/told_calibration.hpp"

#include "apps/lab/simulation/world/seeded_random.hpp"
#include "modules/core/lie.hpp"

namespace km {
namespace {

Eigen::Matrix3d random_rotation(double angle_rad, GaussianRandom& random) {
  const Eigen::Vector3d axis = random.draw3().normalized();
  return so3_exp(angle_rad * axis);
}

}  // namespace

SensorRig told_rig(const SensorRig& truth, const CalibrationErrorConfig& config,
                   std::uint64_t seed) {
  checked(config);
  const bool exact =
      config.focal_share == 0.0 && config.mounting_rad == 0.0 && config.stereo_rad == 0.0;
  if (exact) return truth;  // not even rounded
  SensorRig told = truth;
  GaussianRandom random(SeededRandom{seed});
  const double scale = 1.0 + (random.draw() < 0.0 ? -1.0 : 1.0) * config.focal_share;
  const Eigen::Matrix3d R_mounting = random_rotation(config.mounting_rad, random);
  const Eigen::Matrix3d R_stereo = random_rotation(config.stereo_rad, random);
  const Eigen::Vector3d middle = 0.5 * (truth.stereo.cameras[0].T_body_cam.translation() +
                                        truth.stereo.cameras[1].T_body_cam.translation());
  for (Camera& camera : told.stereo.cameras) {
    camera.fx *= scale;
    camera.fy *= scale;
    SE3& T = camera.T_body_cam;
    T = make_pose(R_mounting * T.linear(), middle + R_mounting * (T.translation() - middle));
  }
  SE3& T_right = told.stereo.cameras[1].T_body_cam;
  T_right.linear() = T_right.linear() * R_stereo;
  return told;
}

}  // namespace km
