#include "apps/lab/simulation/motion/default_rig.hpp"

#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

// EuRoC's calibration is for this resolution.
constexpr double kWidth_px = 752.0;
constexpr double kHeight_px = 480.0;
constexpr double kVehicleBaseline_m = 0.27;

SE3 pose_of_rows(const Eigen::Matrix<double, 3, 4>& rows) {
  return make_pose(nearest_rotation(rows.leftCols<3>()), rows.col(3));
}

StereoRig euroc_stereo() {
  Camera left, right;
  left.fx = 458.654, left.fy = 457.296, left.cx = 367.215, left.cy = 248.375;
  left.lens =
      Lens(LensModel::kRadialTangential, {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05});
  right.fx = 457.587, right.fy = 456.134, right.cx = 379.999, right.cy = 255.238;
  right.lens =
      Lens(LensModel::kRadialTangential, {-0.28368365, 0.07451284, -0.00010473, -3.55590700e-05});
  Eigen::Matrix<double, 3, 4> T_left, T_right;
  T_left << 0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975,  //
      0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768,            //
      -0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949;
  T_right << 0.0125552670891, -0.999755099723, 0.0182237714554, -0.0198435579556,  //
      0.999598781151, 0.0130119051815, 0.0251588363115, 0.0453689425024,           //
      -0.0253898008918, 0.0179005838253, 0.999517347078, 0.00786212447038;
  left.T_body_cam = pose_of_rows(T_left);
  right.T_body_cam = pose_of_rows(T_right);
  StereoRig stereo;
  stereo.cameras = {left, right};
  return stereo;
}

// Scaled by the widths about the image's centre; pixel centres have whole coordinates.
void resize(Camera& camera, int width, int height) {
  const double scale = width / kWidth_px;
  camera.cx = (camera.cx + 0.5 - 0.5 * kWidth_px) * scale + 0.5 * width - 0.5;
  camera.cy = (camera.cy + 0.5 - 0.5 * kHeight_px) * scale + 0.5 * height - 0.5;
  camera.fx *= scale;
  camera.fy *= scale;
  camera.width = width;
  camera.height = height;
}

// Cameras side by side that look along x, in front of the inertial sensor. They are rotated
// slightly relative to each other, as assembled ones are.
void mount_on_vehicle(StereoRig& stereo) {
  Eigen::Matrix3d R_body_cam;
  R_body_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Eigen::Vector3d off_left(0.004, -0.006, 0.002);  // [rad]
  const Eigen::Vector3d off_right(-0.003, 0.005, -0.004);
  const double half = 0.5 * kVehicleBaseline_m;
  stereo.cameras[0].T_body_cam = make_pose(R_body_cam * so3_exp(off_left), {0.05, half, 0.02});
  stereo.cameras[1].T_body_cam = make_pose(R_body_cam * so3_exp(off_right), {0.05, -half, 0.02});
}

}  // namespace

SensorRig default_rig(RigKind kind, int width, int height) {
  SensorRig rig;
  rig.stereo = euroc_stereo();
  for (Camera& camera : rig.stereo.cameras) resize(camera, width, height);
  if (kind == RigKind::kVehicle) mount_on_vehicle(rig.stereo);
  return rig;
}

Eigen::Matrix3d vehicle_from_body(RigKind kind) {
  if (kind == RigKind::kVehicle) return Eigen::Matrix3d::Identity();
  Eigen::Matrix3d R_vehicle_body;  // EuRoC's body: x up, y right, z forward
  R_vehicle_body << 0, 0, 1, 0, -1, 0, 1, 0, 0;
  return R_vehicle_body;
}

}  // namespace km
