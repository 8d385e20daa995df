#pragma once

#include <span>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/vio/fixed_lag_smoother.hpp"

namespace km {

enum class StartStatus {
  kAtRest,          ///< Images and inertial data agree that the body stands still.
  kInMotion,        ///< Motion from stereo, aligned with the inertial data.
  kContinues,       ///< Continues from the last state of an earlier process; not a result of
                    ///< guess_start().
  kByImages,        ///< From one image, without an inertial sensor.
  kTooFewImages,    ///< Fewer than kMinStartImages.
  kTooFewFeatures,  ///< Too few features with depth, or too few tracked, for motion from stereo.
  kInconsistent,    ///< Stereo and inertial data contradict each other.
};

[[nodiscard]] constexpr bool started(StartStatus status) {
  return status == StartStatus::kAtRest || status == StartStatus::kInMotion ||
         status == StartStatus::kContinues || status == StartStatus::kByImages;
}

/// Guessed states of the first images, for FixedLagSmoother::start(), or the reason why there are
/// none.
struct StartGuess {
  StartStatus status = StartStatus::kTooFewImages;
  std::vector<OdometryState> states;  ///< One for each image if started().
};

inline constexpr std::size_t kMinStartImages = 5;

/// Rotation that turns the specific force `accel` of a body at rest upwards: R_odom_body with z of
/// odom along R * accel and no defined heading. Throws std::invalid_argument for a zero vector.
[[nodiscard]] Eigen::Matrix3d upright(const Eigen::Vector3d& accel);

/// Estimates pose and motion of the body from images and inertial samples alone.
///
/// If the images and both inertial sensors show rest, the mean accelerometer gives the attitude,
/// the mean gyroscope gives its bias, and the velocity is zero. Otherwise stereo gives the metric
/// motion. Then gyro bias, velocities, gravity and accelerometer bias follow linearly from the
/// preintegrated samples, as in VINS-Mono (Qin et al., TRO 2018, Sec. V-B), but with the scale
/// known from stereo. Gravity has the length of `config`, the accelerometer bias a prior of
/// accel_bias_sigma. The first position is zero, the heading free. `frames[0].samples` are not
/// used.
[[nodiscard]] StartGuess guess_start(std::span<const InertialFrame> frames, const SensorRig& rig,
                                     const VioConfig& config);

/// Start of odometry by images alone, on one image. The state is at the origin, its attitude that
/// of level_with_camera(), and its velocity unknown. The image needs features with a depth.
[[nodiscard]] StartGuess guess_start_by_images(const InertialFrame& frame, const SensorRig& rig);

}  // namespace km
