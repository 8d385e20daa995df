#include "modules/simulation/motion/spline_trajectory.hpp"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace km {
namespace {

using Control = SplineTrajectory::Control;

constexpr double kMinLength = 0.5;  // of a control's quaternion
constexpr double kMaxLength = 2.0;
constexpr double kMinCosine = 0.70710678118;  // of half the angle between neighbours

[[noreturn]] void refuse(const std::string& problem) {
  throw std::invalid_argument("spline trajectory: " + problem);
}

// The controls with quaternions on one side of R^4: q and -q are the same rotation, but not the
// same control.
std::vector<Control> aligned(std::vector<Control> controls, double start_s, double interval_s) {
  if (!std::isfinite(start_s)) refuse("start " + std::to_string(start_s) + " s");
  if (!(interval_s > 0.0) || !std::isfinite(interval_s))
    refuse("interval " + std::to_string(interval_s) + " s is not positive");
  if (controls.size() < QuinticBasis::kOrder)
    refuse(std::to_string(controls.size()) + " controls, at least 6 are needed");
  for (std::size_t k = 0; k < controls.size(); ++k) {
    auto q = controls[k].tail<4>();
    const double length = q.norm();
    if (!controls[k].allFinite() || length < kMinLength || length > kMaxLength)
      refuse("control " + std::to_string(k) + " is no pose");
    if (k == 0) continue;
    const auto previous = controls[k - 1].tail<4>();
    const double cosine = q.dot(previous) / (length * previous.norm());
    if (std::abs(cosine) < kMinCosine)
      refuse("more than 90 degrees between controls " + std::to_string(k - 1) + " and " +
             std::to_string(k));
    if (cosine < 0.0) q = -q.eval();
  }
  return controls;
}

Eigen::Quaterniond quaternion(const Eigen::Vector4d& xyzw) {
  return Eigen::Quaterniond(xyzw);
}

}  // namespace

SplineTrajectory::SplineTrajectory(double start_s, double interval_s, std::vector<Control> controls)
    : curve_(start_s, interval_s, aligned(std::move(controls), start_s, interval_s)) {}

BodyMotion SplineTrajectory::motion(double t_s) const {
  if (!(start_s() <= t_s && t_s <= end_s()))
    throw std::out_of_range("trajectory: time " + std::to_string(t_s) + " s is outside [" +
                            std::to_string(start_s()) + ", " + std::to_string(end_s()) + "]");
  const auto sample = curve_.at(t_s);
  const Eigen::Quaterniond s = quaternion(sample.value.tail<4>());
  const Eigen::Quaterniond s_dot = quaternion(sample.first.tail<4>());
  return {make_pose(s.normalized().toRotationMatrix(), sample.value.head<3>()),
          sample.first.head<3>(), sample.second.head<3>(),
          2.0 / s.squaredNorm() * (s.conjugate() * s_dot).vec()};
}

SplineTrajectory::Control spline_control(const SE3& T) {
  Control control;
  control << T.translation(), Eigen::Quaterniond(T.linear()).normalized().coeffs();
  return control;
}

SplineTrajectory spline_along(double start_s, double interval_s, std::span<const SE3> poses) {
  std::vector<Control> controls;
  for (const SE3& T : poses) controls.push_back(spline_control(T));
  return {start_s, interval_s, std::move(controls)};
}

}  // namespace km
