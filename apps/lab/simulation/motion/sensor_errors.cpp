#include "apps/lab/simulation/motion/sensor_errors.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/lab/simulation/world/seeded_random.hpp"
#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

constexpr double kWarmUp_s = 60.0;  // time constant of the temperature after the start

Eigen::Vector3d signed_size(double size, SeededRandom& random) {
  Eigen::Vector3d values;
  for (double& value : values) value = size * static_cast<double>(random.sign());
  return values;
}

// Identity with errors: scales on the diagonal, tilts of the axes beside it.
Eigen::Matrix3d scaled_and_tilted(double scale, double tilt_rad, SeededRandom& random) {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  for (Eigen::Index row = 0; row < 3; ++row)
    for (Eigen::Index column = 0; column < 3; ++column)
      matrix(row, column) +=
          (row == column ? scale : tilt_rad) * static_cast<double>(random.sign());
  return matrix;
}

}  // namespace

double InertialErrors::warmth(double t_s) const {
  return 1.0 - std::exp(-std::max(t_s, 0.0) / kWarmUp_s);
}

Eigen::Vector3d InertialErrors::sway(double t_s) const {
  const double turn = 2.0 * std::numbers::pi * vibration_hz * t_s;
  Eigen::Vector3d sines;
  for (Eigen::Index axis = 0; axis < 3; ++axis) sines[axis] = std::sin(turn + phase[axis]);
  return sines;
}

InertialErrors draw_inertial_errors(const InertialErrorConfig& config, std::uint64_t seed) {
  checked(config);
  SeededRandom random(seed);
  InertialErrors errors{
      .gyro_matrix = scaled_and_tilted(config.gyro_scale, config.misalignment_rad, random),
      .accel_matrix = scaled_and_tilted(config.accel_scale, config.misalignment_rad, random)};
  errors.gyro_vibration = config.vibration_gyro_rps;
  errors.accel_vibration = config.vibration_accel_mps2;
  for (double& phase : errors.phase) phase = 2.0 * std::numbers::pi * random.unit();
  errors.vibration_hz = config.vibration_hz;
  errors.gyro_warm = signed_size(config.warm_gyro_rps, random);
  errors.accel_warm = signed_size(config.warm_accel_mps2, random);
  return errors;
}

namespace {

// Error of a clock that runs since `start` with the drift `drift` [ns].
Stamp drifted(Stamp start, Stamp true_time, double drift) {
  return std::llround(drift * static_cast<double>(true_time - start));
}

}  // namespace

RobotClock::RobotClock(const TimingErrorConfig& config, Stamp start, Stamp end, std::uint64_t seed)
    : start_(start) {
  checked(config);
  SeededRandom random(seed);
  drift_ = static_cast<double>(random.sign()) * config.drift_ppm * 1e-6;
  camera_drift_ = static_cast<double>(random.sign()) * config.camera_drift_ppm * 1e-6;
  jump_ = nanoseconds(config.jump_s);
  delay_ = nanoseconds(config.camera_delay_s);
  if (!(config.jump_every_s > 0.0) || jump_ == 0) return;
  // Intervals from half to one and a half of the mean.
  for (Stamp at = start;;) {
    at += nanoseconds(config.jump_every_s * (0.5 + random.unit()));
    if (at > end) return;
    jumps_.push_back(at);
  }
}

Stamp RobotClock::inertial(Stamp true_time) const {
  const auto past = std::upper_bound(jumps_.begin(), jumps_.end(), true_time) - jumps_.begin();
  return true_time + drifted(start_, true_time, drift_) + static_cast<Stamp>(past) * jump_;
}

Stamp RobotClock::camera(Stamp true_time) const {
  return inertial(true_time) + drifted(start_, true_time, camera_drift_) + delay_;
}

std::vector<Stamp> without_dropped(const std::vector<Stamp>& images,
                                   const TimingErrorConfig& config, std::uint64_t seed) {
  checked(config);
  if (!(config.dropped_share > 0.0)) return images;
  // In balance as many runs of losses begin as end: share / run = (1 - share) * begin.
  const double begin = config.dropped_share / (config.dropped_run * (1.0 - config.dropped_share));
  const double go_on = 1.0 - 1.0 / config.dropped_run;
  SeededRandom random(seed);
  std::vector<Stamp> kept;
  bool lost = false;
  for (const Stamp stamp : images) {
    lost = random.chance(lost ? go_on : begin) && !kept.empty();
    if (!lost) kept.push_back(stamp);
  }
  return kept;
}

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
