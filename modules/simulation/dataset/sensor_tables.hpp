#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "modules/core/frame.hpp"
#include "modules/core/geometry.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// What is true of a robot at one instant: a row of state_groundtruth_estimate0.
struct TrueState {
  Stamp stamp = 0;
  SE3 T_world_body = SE3::Identity();
  Eigen::Vector3d velocity_world = Eigen::Vector3d::Zero();  ///< [m/s]
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();       ///< [rad/s]
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();      ///< [m/s^2]
};

/// Texts of data.csv in EuRoC's columns; numbers read back as the same doubles.
[[nodiscard]] std::string imu_csv(const std::vector<ImuSample>& samples);
[[nodiscard]] std::string state_csv(const std::vector<TrueState>& states);

/// Rows `stamp, stamp.extension`.
[[nodiscard]] std::string image_csv(const std::vector<Stamp>& stamps, const std::string& extension);

}  // namespace km
