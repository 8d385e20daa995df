#include "modules/core/camera/calibration_limits.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "modules/core/geometry/lie.hpp"
#include "modules/core/io/text_table.hpp"

namespace km {
namespace {

constexpr double kMaxNonOrthonormality = 1e-3;
constexpr Bounds<double> kFocal_px{1.0, 1e6};
constexpr Bounds<double> kCenter_px{-1e6, 1e6};
constexpr Bounds<double> kCoefficient{-1e3, 1e3};
constexpr Bounds<double> kLever_m{-1e3, 1e3};  // position of a sensor on a robot
constexpr double kMaxSide_px = 65536.0, kMaxArea_px = 1e8;
constexpr double kMinBaseline_m = 1e-3;

}  // namespace

std::optional<std::string> resolution_problem(double width, double height) {
  for (const double side : {width, height})
    if (!(side >= 1.0 && side <= kMaxSide_px) || side != std::floor(side))
      return "sides are whole numbers of pixels from 1 to 65536";
  if (width * height > kMaxArea_px) return "more than " + shortest_text(kMaxArea_px) + " pixels";
  return std::nullopt;
}

std::optional<std::string> intrinsics_problem(const Camera& camera) {
  for (const double focal : {camera.fx, camera.fy})
    if (!kFocal_px.contains(focal))
      return "a focal length of " + shortest_text(focal) + " px is outside " + kFocal_px.text();
  for (const double center : {camera.cx, camera.cy})
    if (!kCenter_px.contains(center))
      return "a principal point at " + shortest_text(center) + " px is outside " +
             kCenter_px.text();
  return std::nullopt;
}

std::optional<std::string> coefficients_problem(std::span<const double> values) {
  for (const double value : values)
    if (!kCoefficient.contains(value))
      return shortest_text(value) + " is outside " + kCoefficient.text();
  return std::nullopt;
}

std::optional<std::string> transform_problem(const Eigen::Matrix4d& T) {
  if (T.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) return ": last row is not 0 0 0 1";
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const double error = (R * R.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (!(error <= kMaxNonOrthonormality))
    return " is not a rotation: |R R^T - I| = " + std::to_string(error) + ", at most " +
           std::to_string(kMaxNonOrthonormality) + " is accepted";
  if (R.determinant() < 0.0) return " is a reflection: det R = -1";
  for (const double lever_m : T.topRightCorner<3, 1>())
    if (!kLever_m.contains(lever_m))
      return ": a translation of " + shortest_text(lever_m) + " m is outside " + kLever_m.text();
  return std::nullopt;
}

std::optional<std::string> pair_problem(const StereoRig& rig) {
  // No lens has bearings farther from its axis.
  static const double kMost_rad = 2.0 * std::atan(Lens::kMaxBearing);
  const double cosine = rig.T_left_right()(2, 2);
  if (cosine < std::cos(kMost_rad))
    return "makes the cameras look " + fixed(kDegrees * std::acos(std::max(cosine, -1.0)), 0) +
           " degrees apart (back to back, or one pose is inverted): no point is in both images; "
           "name two cameras that look in one direction";
  if (!(rig.baseline_m() >= kMinBaseline_m)) return "puts the right camera where the left one is";
  if (rig.T_left_right().translation().x() < -0.5 * rig.baseline_m())
    return "puts the right camera to the left of the left one: exchange them";
  return std::nullopt;
}

SE3 rigid_transform(const Eigen::Matrix4d& T) {
  return make_pose(nearest_rotation(T.topLeftCorner<3, 3>()), T.topRightCorner<3, 1>());
}

}  // namespace km
