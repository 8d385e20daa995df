#include "modules/recordings/ros_camera.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "modules/core/camera/calibration_limits.hpp"

namespace km {
namespace {

[[noreturn]] void refuse(const RosCameraInfo& info, const std::string& problem) {
  throw std::invalid_argument("CameraInfo of frame '" + info.header.frame_id + "': " + problem);
}

// The first `count` coefficients of D, with zeros for missing ones. Throws if others are not 0.
std::vector<double> coefficients(const RosCameraInfo& info, std::size_t count) {
  std::vector<double> D = info.d;
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
  const bool none = std::all_of(info.d.begin(), info.d.end(), [](double k) { return k == 0.0; });
  if (none && (model.empty() || model == "none")) return {};
  refuse(info, "distortion_model '" + model +
                   "' is not supported, only plumb_bob, rational_polynomial, equidistant and "
                   "fisheye");
}

void refuse_parts(const RosCameraInfo& info) {
  const auto& region = info.roi;
  const bool is_whole = (region.width == 0 && region.height == 0) ||
                        (region.width == info.width && region.height == info.height);
  if (info.binning_x > 1 || info.binning_y > 1)
    refuse(info, "binning_x " + std::to_string(info.binning_x) + ", binning_y " +
                     std::to_string(info.binning_y) +
                     ": binned images are not supported; name a calibration of them");
  if (!is_whole || region.x_offset != 0 || region.y_offset != 0)
    refuse(info,
           "roi: images of a part of the camera are not supported; name a calibration of "
           "them");
}

}  // namespace

Camera camera_of(const RosCameraInfo& info, RosImages images) {
  const bool raw = images == RosImages::kRaw;
  const std::string matrix = raw ? "K" : "P";
  const auto is_zero = [](const auto& numbers) {
    return std::ranges::all_of(numbers, [](double number) { return number == 0.0; });
  };
  const bool has_K = !is_zero(info.k), has_P = !is_zero(info.p);
  if (!(raw ? has_K : has_P))
    refuse(info, matrix + " is 0: the camera is not calibrated" +
                     (has_P   ? "; P is not, so its images are rectified (rectified: true)"
                      : has_K ? "; K is not: state rectified: false if its images are raw, or else "
                                "name their calibration in the rig file (calibration: ...)"
                              : ""));
  refuse_parts(info);
  if (const auto problem = resolution_problem(info.width, info.height))
    refuse(info, "width and height: " + *problem);
  Camera camera;
  camera.width = static_cast<int>(info.width);
  camera.height = static_cast<int>(info.height);
  const double* row0 = raw ? info.k.data() : info.p.data();
  const double* row1 = row0 + (raw ? 3 : 4);
  camera.fx = row0[0], camera.cx = row0[2], camera.fy = row1[1], camera.cy = row1[2];
  if (const auto problem = intrinsics_problem(camera)) refuse(info, matrix + ": " + *problem);
  if (row0[1] != 0.0)
    refuse(info, matrix + ": a skew of " + shortest_text(row0[1]) + " is not supported");
  if (raw) camera.lens = lens_of(info);
  return camera;
}

SE3 T_frame_camera(const RosCameraInfo& info, RosImages images) {
  const bool has_rotation = std::ranges::any_of(info.r, [](double r) { return r != 0.0; });
  if (images == RosImages::kRectified || !has_rotation) return SE3::Identity();
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T.topLeftCorner<3, 3>() =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(info.r.data());
  if (const auto problem = transform_problem(T)) refuse(info, 'R' + *problem);
  return rigid_transform(T);
}

std::optional<double> baseline_m(const RosCameraInfo& right) {
  const double baseline_m = -right.p[3] / right.p[0];
  if (!(baseline_m > 0.0) || !std::isfinite(baseline_m)) return std::nullopt;
  return baseline_m;
}

}  // namespace km
