#include "modules/recordings/ros_camera.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "modules/core/calibration_limits.hpp"

namespace km {
namespace {

[[noreturn]] void refuse(const RosCameraInfo& info, const std::string& problem) {
  throw std::invalid_argument("CameraInfo of frame '" + info.header.frame + "': " + problem);
}

// D with zeros up to `count`; what lies beyond must be 0.
std::vector<double> coefficients(const RosCameraInfo& info, std::size_t count) {
  std::vector<double> D = info.D;
  const bool cut = std::any_of(D.begin() + static_cast<std::ptrdiff_t>(std::min(count, D.size())),
                               D.end(), [](double k) { return k != 0.0; });
  if (cut)
    refuse(info, "D has " + std::to_string(D.size()) + " coefficients; of " +
                     info.distortion_model + " only " + std::to_string(count) + " are supported");
  D.resize(count, 0.0);
  if (const auto problem = coefficients_problem(D)) refuse(info, "D: " + *problem);
  return D;
}

Lens lens_of(const RosCameraInfo& info) {
  const std::string& model = info.distortion_model;
  if (model == "equidistant" || model == "fisheye")
    return Lens(LensModel::kEquidistant, coefficients(info, 4));
  if (model == "plumb_bob") return Lens(LensModel::kRadialTangential, coefficients(info, 5));
  if (model == "rational_polynomial")
    return Lens(LensModel::kRadialTangential, coefficients(info, 8));
  const bool none = std::all_of(info.D.begin(), info.D.end(), [](double k) { return k == 0.0; });
  if (none && (model.empty() || model == "none")) return {};
  refuse(info, "distortion_model '" + model +
                   "' is not supported, only plumb_bob, rational_polynomial, equidistant and "
                   "fisheye");
}

// R as the rotation from the camera to the rectified one.
Eigen::Matrix3d rectifying_rotation(const RosCameraInfo& info) {
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T.topLeftCorner<3, 3>() =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(info.R.data());
  if (const auto problem = transform_problem(T)) refuse(info, 'R' + *problem);
  return rigid_transform(T).linear();
}

// B of P's fourth number, Tx = -fx B.
double baseline_of(const RosCameraInfo& info) {
  return -info.P[3] / info.P[0];
}

}  // namespace

Camera camera_of(const RosCameraInfo& info, RosImages images) {
  if (std::all_of(info.K.begin(), info.K.end(), [](double k) { return k == 0.0; }))
    refuse(info, "K is 0: the camera is not calibrated");
  if (const auto problem = resolution_problem(info.width, info.height))
    refuse(info, "width and height: " + *problem);
  Camera camera;
  camera.width = static_cast<int>(info.width);
  camera.height = static_cast<int>(info.height);
  const bool raw = images == RosImages::kRaw;
  const double* row0 = raw ? info.K.data() : info.P.data();
  const double* row1 = row0 + (raw ? 3 : 4);
  camera.fx = row0[0], camera.cx = row0[2], camera.fy = row1[1], camera.cy = row1[2];
  const std::string matrix = raw ? "K" : "P";
  if (const auto problem = intrinsics_problem(camera)) refuse(info, matrix + ": " + *problem);
  if (row0[1] != 0.0)
    refuse(info, matrix + ": a skew of " + shortest_text(row0[1]) + " is not supported");
  if (raw) camera.lens = lens_of(info);
  return camera;
}

StereoRig stereo_of(const RosCameraInfo& left, const RosCameraInfo& right, RosImages images,
                    const SE3& T_body_left) {
  StereoRig rig{{camera_of(left, images), camera_of(right, images)}};
  for (const RosCameraInfo* info : {&left, &right})
    if (!(info->P[0] > 0.0)) refuse(*info, "P has no focal length: no stereo calibration");
  // Both rectified cameras lie on one line, at the places along it that P tells.
  const Eigen::Vector3d t(baseline_of(right) - baseline_of(left), 0.0, 0.0);
  SE3 T_left_right = make_pose(Eigen::Matrix3d::Identity(), t);
  if (images == RosImages::kRaw) {
    const Eigen::Matrix3d R_left_rect = rectifying_rotation(left).transpose();
    T_left_right = make_pose(R_left_rect * rectifying_rotation(right), R_left_rect * t);
  }
  rig.cameras[0].T_body_cam = T_body_left;
  rig.cameras[1].T_body_cam = T_body_left * T_left_right;
  if (!(t.x() > 0.0))
    refuse(right, "P[3] = " + shortest_text(right.P[3]) +
                      ": Tx = -fx * baseline of a right camera is negative");
  if (const auto problem = transform_problem(T_left_right.matrix())) refuse(right, 'P' + *problem);
  if (const auto problem = pair_problem(rig)) refuse(right, "P " + *problem);
  return rig;
}

}  // namespace km
