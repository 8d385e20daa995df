#include "apps/lab/simulation/motion/inertial_errors.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/lab/simulation/world/seeded_random.hpp"

namespace km {
namespace {

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
  return 1.0 - std::exp(-std::max(t_s, 0.0) / warm_up_s);
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
  InertialErrors errors;
  errors.gyro_matrix = scaled_and_tilted(config.gyro_scale, config.misalignment_rad, random);
  errors.accel_matrix = scaled_and_tilted(config.accel_scale, config.misalignment_rad, random);
  errors.gyro_vibration.setConstant(config.vibration_gyro_rps);
  errors.accel_vibration.setConstant(config.vibration_accel_mps2);
  for (double& phase : errors.phase) phase = 2.0 * std::numbers::pi * random.unit();
  errors.vibration_hz = config.vibration_hz;
  errors.gyro_warm = signed_size(config.warm_gyro_rps, random);
  errors.accel_warm = signed_size(config.warm_accel_mps2, random);
  errors.warm_up_s = config.warm_up_s;
  return errors;
}

}  // namespace km
