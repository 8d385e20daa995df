#include "apps/lab/simulation/motion/flight_trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include "apps/lab/simulation/world/seeded_random.hpp"

namespace km {
namespace {

using Controls = std::vector<Eigen::Vector4d>;  // position [m] and yaw [rad]

constexpr double kPlanInterval_s = 1.0;   // interval of the flight plan's controls
constexpr double kGustInterval_s = 0.25;  // interval of the gusts' controls
constexpr double kPoseInterval_s = 0.01;
constexpr double kRotorDrag_hz = 0.3;  // deceleration by drag per speed
constexpr double kStandstill_s = 2.0;  // exactly at rest on the ground at the start
constexpr double kMaxSpeed_mps = 1.0;  // towards the next waypoint
constexpr double kMaxYawRate_radps = 1.047;
constexpr double kGusts_m = 0.008;  // standard deviation of the displacement by gusts
constexpr double kMaxGusts = 2.5;   // standard deviations
constexpr double kMinLeg_m = 0.8;
constexpr double kStartYaw =
    std::numbers::pi / 4.0;  // largest angle between the start yaw and the direction to the middle
constexpr int kTries = 20;

Eigen::Vector3d random_point(const Eigen::AlignedBox3d& box, SeededRandom& random) {
  Eigen::Vector3d point;
  for (int axis = 0; axis < 3; ++axis)
    point[axis] = box.min()[axis] + random.unit() * box.sizes()[axis];
  return point;
}

// A point in `box` that is not too near to `from`.
Eigen::Vector3d next_waypoint(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& from,
                              SeededRandom& random) {
  Eigen::Vector3d point = random_point(box, random);
  for (int k = 0; k < kTries && (point - from).norm() < kMinLeg_m; ++k)
    point = random_point(box, random);
  return point;
}

// Appends controls to `end` at `speed_mps` while the yaw turns by `turn`.
void append_leg(const Eigen::Vector3d& end, double turn, double speed_mps, double yaw_rate,
                Controls& controls) {
  const Eigen::Vector4d begin = controls.back();
  Eigen::Vector4d change;
  change << end - begin.head<3>(), turn;
  const double duration = std::max(change.head<3>().norm() / speed_mps, std::abs(turn) / yaw_rate);
  const int steps = std::max(1, static_cast<int>(std::ceil(duration / kPlanInterval_s)));
  for (int k = 1; k <= steps; ++k) controls.push_back(begin + change * k / steps);
}

// Rest on the floor, climb, then flight from waypoint to waypoint. A spline stays in the convex
// hull of its controls, so in the box, and below the speed between them.
UniformSpline<4> flight_plan(const Eigen::AlignedBox3d& volume, const Eigen::AlignedBox3d& air,
                             const FlightOptions& options) {
  auto random = SeededRandom::stream(options.seed, 31);
  const double pi = std::numbers::pi;
  Eigen::Vector4d start;
  start.head<3>() = random_point(air, random);
  start.z() = volume.min().z();
  // At the start it looks into the room, not at a near wall.
  const Eigen::Vector3d inwards = volume.center() - start.head<3>();
  start[3] = std::atan2(inwards.y(), inwards.x()) + kStartYaw * (2.0 * random.unit() - 1.0);
  Controls controls(5, start);
  const double end_s = std::max(0.0, options.duration_s - kStandstill_s) + 1.0;
  Eigen::Vector3d target = start.head<3>();  // first straight up
  target.z() = air.min().z() + (0.3 + 0.4 * random.unit()) * air.sizes().z();
  double turn = 0.0;
  while (static_cast<double>(controls.size()) * kPlanInterval_s < end_s + 6.0 * kPlanInterval_s) {
    const double speed = kMaxSpeed_mps * (0.4 + 0.6 * random.unit());
    const double yaw_rate = kMaxYawRate_radps * (0.3 + 0.7 * random.unit());
    append_leg(target, turn, speed, yaw_rate, controls);
    target = next_waypoint(air, target, random);
    turn = pi * (2.0 * random.unit() - 1.0);
  }
  return {kStandstill_s, kPlanInterval_s, std::move(controls)};
}

UniformSpline<3> gusts(const FlightOptions& options, double first_s) {
  GaussianRandom random(SeededRandom::stream(options.seed, 32));
  std::vector<Eigen::Vector3d> controls(5, Eigen::Vector3d::Zero());
  const double span_s = std::max(0.0, options.duration_s - first_s);
  const int count = static_cast<int>(std::ceil(span_s / kGustInterval_s)) + 6;
  for (int k = 0; k < count; ++k)
    controls.push_back(kGusts_m * random.draw3().cwiseMax(-kMaxGusts).cwiseMin(kMaxGusts));
  return {first_s, kGustInterval_s, std::move(controls)};
}

// Time at which the first climb passes `height`; the plan does not go below it again.
double time_above(const UniformSpline<4>& plan, double height) {
  double t = plan.start();
  while (t < plan.end() && plan.at(t).value.z() < height) t += kPoseInterval_s;
  return t;
}

// Rotation with the z axis along the thrust, and the x axis as near to `yaw` as possible.
Eigen::Matrix3d attitude(const Eigen::Vector3d& thrust, double yaw) {
  const Eigen::Vector3d z = thrust.normalized();
  const Eigen::Vector3d y =
      z.cross(Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0.0)).normalized();
  Eigen::Matrix3d R;
  R << y.cross(z), y, z;
  return R;
}

}  // namespace

SplineTrajectory make_flight_trajectory(const Eigen::AlignedBox3d& volume,
                                        const FlightOptions& options) {
  // Gusts displace the vehicle by at most this, and only once it is in the air.
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(kMaxGusts * kGusts_m);
  const Eigen::AlignedBox3d air(volume.min() + margin, volume.max() - margin);
  const UniformSpline<4> plan = flight_plan(volume, air, options);
  const UniformSpline<3> push = gusts(options, time_above(plan, air.min().z()));

  // Begins two poses before the start, where the vehicle is at rest, and ends shortly after the
  // end.
  const auto count = static_cast<std::size_t>(std::ceil(options.duration_s / kPoseInterval_s)) + 6;
  std::vector<SE3> poses;
  for (std::size_t k = 0; k < count; ++k) {
    const double t = kPoseInterval_s * (static_cast<double>(k) - 2.0);
    const auto planned = plan.at(t);
    const auto pushed = push.at(t);
    const Eigen::Vector3d thrust = planned.second.head<3>() + pushed.second +
                                   kRotorDrag_hz * (planned.first.head<3>() + pushed.first) +
                                   kGravity_mps2 * Eigen::Vector3d::UnitZ();
    poses.push_back(make_pose(attitude(thrust, planned.value[3]) * options.R_vehicle_body,
                              planned.value.head<3>() + pushed.value));
  }
  return spline_along(0.0, kPoseInterval_s, poses);
}

namespace {

using Control = SplineTrajectory::Control;

constexpr double kFitInterval_s = 0.02;  // interval of the spline's controls
// Standard deviations of the poses; larger deviations lose weight as outliers.
constexpr double kPositionNoise_m = 0.0005;
constexpr double kRotationNoise_rad = 0.0005;
// Standard deviations of the derivatives of the accelerations.
constexpr double kJerk_mps3 = 100.0;
constexpr double kRotationJerk = 1000.0;  // [rad/s^3]

// The poses as rows of position and quaternion, neighbouring quaternions on one side of R^4.
Eigen::MatrixXd pose_rows(std::span<const StampedPose> poses) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(poses.size()), 7);
  for (std::size_t k = 0; k < poses.size(); ++k) {
    Control control = spline_control(poses[k].T);
    const auto row = static_cast<Eigen::Index>(k);
    if (k > 0 && control.tail<4>().dot(rows.row(row - 1).tail<4>().transpose()) < 0.0)
      control.tail<4>() = -control.tail<4>().eval();
    rows.row(row) = control.transpose();
  }
  return rows;
}

}  // namespace

SplineTrajectory fit_recording(std::span<const StampedPose> poses, Stamp epoch) {
  // The intervals are stretched a little, so that a whole number of them spans the recording.
  const double span_s = seconds_between(poses.front().stamp, poses.back().stamp);
  const double intervals = std::max(1.0, std::round(span_s / kFitInterval_s));
  const double interval_s = span_s / intervals;
  std::vector<double> positions;
  for (const StampedPose& pose : poses)
    positions.push_back(
        std::min(seconds_between(poses.front().stamp, pose.stamp) / interval_s, intervals));

  const Eigen::MatrixXd rows = pose_rows(poses);
  const auto count = static_cast<std::size_t>(intervals) + 5;
  const double cubed = interval_s * interval_s * interval_s;
  const Eigen::MatrixXd translations =
      fit_spline(positions, rows.leftCols(3), {count, kPositionNoise_m, kJerk_mps3 * cubed});
  // A quaternion moves by half the angle.
  const Eigen::MatrixXd rotations = fit_spline(
      positions, rows.rightCols(4), {count, 0.5 * kRotationNoise_rad, 0.5 * kRotationJerk * cubed});

  std::vector<Control> controls(count);
  for (std::size_t k = 0; k < count; ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    controls[k] << translations.row(row).transpose(), rotations.row(row).transpose();
  }
  return {seconds_between(epoch, poses.front().stamp), interval_s, std::move(controls)};
}

}  // namespace km
