#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "apps/lab/simulation/world/world.hpp"
#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/geometry.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// True state of a robot at one instant: a row of state_groundtruth_estimate0.
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

/// Texts of sensor.yaml in the EuRoC/ASL format. Numbers have enough digits to restore the doubles,
/// so a reader gets exactly the calibration used for rendering.
[[nodiscard]] std::string camera_yaml(const Camera& camera, double rate_hz,
                                      const std::string& comment);

/// Properties of a depth camera that the camera in its place does not have.
struct DepthCameraFigures {
  double rate_hz = 20.0;
  double min_range_m = 0.0;
  double max_range_m = 65.0;
  double baseline_m = 0.1;  ///< Baseline of a stereo camera with the same errors.
};

/// A depth camera in the place of `camera`, pixel for pixel, with images in mm.
[[nodiscard]] std::string depth_yaml(const Camera& camera, const DepthCameraFigures& figures,
                                     const std::string& comment);

/// The inertial sensor, which is the body frame.
[[nodiscard]] std::string imu_yaml(const ImuNoise& noise, const std::string& comment);

/// The world's true objects, as read_objects() of modules/objects reads them: class and upright box
/// of each object. An object of two classes has an entry for each.
[[nodiscard]] std::string true_objects_json(const World& world, const LabelPalette& palette);

/// The world's true mesh as binary little-endian PLY: vertices x, y, z [m], faces with their class
/// as `label` and its colour as red, green, blue.
[[nodiscard]] std::vector<std::uint8_t> world_ply(const World& world, const LabelPalette& palette);

}  // namespace km
