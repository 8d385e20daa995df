#include "apps/lab/simulation/motion/recorded_trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace km {
namespace {

using Control = SplineTrajectory::Control;

void check(std::span<const StampedPose> poses) {
  if (poses.size() < 2)
    throw std::invalid_argument("recorded trajectory: " + std::to_string(poses.size()) +
                                " poses, at least 2 are needed");
  for (std::size_t k = 1; k < poses.size(); ++k)
    if (poses[k].stamp <= poses[k - 1].stamp)
      throw std::invalid_argument("recorded trajectory: stamp " + std::to_string(poses[k].stamp) +
                                  " of pose " + std::to_string(k) +
                                  " is not after the one before it");
}

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

FitDeviation deviation_from(std::span<const StampedPose> poses, Stamp epoch,
                            const SplineTrajectory& trajectory) {
  FitDeviation d;
  for (const StampedPose& pose : poses) {
    const double t_s =
        std::clamp(seconds_between(epoch, pose.stamp), trajectory.start_s(), trajectory.end_s());
    const SE3 error = pose.T.inverse() * trajectory.motion(t_s).T_world_body;
    const double translation = error.translation().norm();
    const double rotation = angle_of(error.linear());
    d.position_rms_m += translation * translation;
    d.rotation_rms_rad += rotation * rotation;
    d.position_max_m = std::max(d.position_max_m, translation);
    d.rotation_max_rad = std::max(d.rotation_max_rad, rotation);
  }
  const auto count = static_cast<double>(poses.size());
  d.position_rms_m = std::sqrt(d.position_rms_m / count);
  d.rotation_rms_rad = std::sqrt(d.rotation_rms_rad / count);
  return d;
}

}  // namespace

RecordedTrajectory fit_recording(std::span<const StampedPose> poses, Stamp epoch,
                                 const RecordingOptions& options) {
  checked(options);
  check(poses);
  // The intervals are stretched a little, so that a whole number of them spans the recording.
  const double span_s = seconds_between(poses.front().stamp, poses.back().stamp);
  const double intervals = std::max(1.0, std::round(span_s / options.interval_s));
  const double interval_s = span_s / intervals;
  std::vector<double> positions;
  for (const StampedPose& pose : poses)
    positions.push_back(
        std::min(seconds_between(poses.front().stamp, pose.stamp) / interval_s, intervals));

  const Eigen::MatrixXd rows = pose_rows(poses);
  const auto count = static_cast<std::size_t>(intervals) + 5;
  const double cubed = interval_s * interval_s * interval_s;
  const Eigen::MatrixXd translations = fit_spline(
      positions, rows.leftCols(3), {count, options.position_noise_m, options.jerk_mps3 * cubed});
  // A quaternion moves by half the angle.
  const Eigen::MatrixXd rotations =
      fit_spline(positions, rows.rightCols(4),
                 {count, 0.5 * options.rotation_noise_rad, 0.5 * options.rotation_jerk * cubed});

  std::vector<Control> controls(count);
  for (std::size_t k = 0; k < count; ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    controls[k] << translations.row(row).transpose(), rotations.row(row).transpose();
  }
  SplineTrajectory trajectory(seconds_between(epoch, poses.front().stamp), interval_s,
                              std::move(controls));
  const FitDeviation deviation = deviation_from(poses, epoch, trajectory);
  return {std::move(trajectory), epoch, deviation};
}

}  // namespace km
