#pragma once

#include <span>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/vio/fixed_lag_smoother.hpp"

namespace km {

enum class StartStatus {
  kAtRest,          ///< Images and inertial data agree that the body stands still.
  kInMotion,        ///< Motion from stereo, aligned with the inertial data.
  kGoesOn,          ///< From the state where an earlier process left off; guess_start() never.
  kTooFewImages,    ///< Fewer than kMinStartImages.
  kTooFewFeatures,  ///< Not enough features with depth, or tracked, to follow the motion by stereo.
  kInconsistent,    ///< Stereo and inertial data do not fit together.
};

[[nodiscard]] constexpr bool started(StartStatus status) {
  return status == StartStatus::kAtRest || status == StartStatus::kInMotion ||
         status == StartStatus::kGoesOn;
}

/// A guess of the states of the first images, for FixedLagSmoother::start(), or why there is none.
struct StartGuess {
  StartStatus status = StartStatus::kTooFewImages;
  std::vector<OdometryState> states;  ///< One for each image if started().
  double image_motion_px = 0.0;       ///< Median between the first and the last image.
  double gravity_mps2 = 0.0;          ///< As measured, before its length is imposed; 0 if not.
};

inline constexpr std::size_t kMinStartImages = 5;

/// Rotation that turns the specific force `accel` of a body at rest upwards: R_odom_body with z of
/// odom along R * accel and no defined heading. Throws std::invalid_argument for a zero vector.
[[nodiscard]] Eigen::Matrix3d upright(const Eigen::Vector3d& accel);

/// Where the body is and how it moves, from images and inertial samples alone.
///
/// At rest, when the images AND both inertial sensors say so: upright by the mean accelerometer,
/// gyro bias its mean, no velocity. Else metric motion from stereo, after which
/// gyro bias, then velocities, gravity and accelerometer bias follow linearly from the
/// preintegrated samples, as in VINS-Mono (Qin et al., TRO 2018, Sec. V-B), the scale being known
/// from stereo; gravity has the length of `config`, the accelerometer bias a prior of
/// accel_bias_sigma. The first position is zero, the heading free. `frames[0].samples` are not
/// used.
[[nodiscard]] StartGuess guess_start(std::span<const InertialFrame> frames, const SensorRig& rig,
                                     const VioConfig& config);

}  // namespace km
