#pragma once

#include <limits>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/vio/tracked_frame.hpp"
#include "modules/vio/vio_config.hpp"
#include "modules/vio/vision_watch.hpp"

namespace km {

/// The motion between images is measured by inertial samples, or assumed to have a constant
/// velocity.
///
/// Odometry by images alone: a rig without an inertial sensor gets a virtual one.
///
/// The prior on the motion is a constant velocity with white noise on the acceleration and on the
/// angular acceleration. In equations, this prior is an inertial factor of samples that are zero,
/// without gravity:
/// - By Eq. (45) of Forster et al., zero samples and zero gravity give v_j = v_i and
///   p_j = p_i + v_i dt. The covariance of the preintegration is q^2 [dt, dt^2/2; dt^2/2, dt^3/3]
///   for [v; p], to the rule by which ImuPreintegration integrates. q is VioConfig::motion_accel.
/// - A gyroscope that reads zero has a bias of minus the angular rate: R_j = R_i exp(-b_i dt). The
///   random walk of the bias is the noise of the angular acceleration, VioConfig::motion_turn. The
///   rotation gets the variance q^2 dt^3/3 of the integrated noise; its correlation with the rate
///   is left out.
/// - The accelerometer bias is held at zero.
///
/// Smoother, marginalisation, rest and resume are therefore those of stereo-inertial odometry.
struct MotionModel {
  static constexpr double kNever_s = std::numeric_limits<double>::infinity();

  bool is_measured = true;  ///< False: by the virtual sensor, so without vertical and calibration.
  /// Checked settings. Without an inertial sensor there is no gravity, no calibration of the
  /// cameras against it, no vertical, and a third of the scale of the loss on reprojection errors.
  VioConfig config;
  /// Longest pause of the images over which the model alone gives the pose. After a longer one
  /// odometry starts again from the last pose.
  double longest_pause_s = 10.0;
  /// Longest time for which the model gives the pose while images do not.
  double longest_coast_s = kNever_s;
  double vision_patience_s = VisionWatch::kPatience_s;
  /// Standard deviation of the guess at a start, and largest plausible value. The "bias" of the
  /// virtual gyroscope is minus the angular rate [rad/s].
  double gyro_bias_sigma_radps = 0.02, max_gyro_bias_radps = 0.5;
  /// Least WindowEquations::error_ratio(). By images alone the window understates the error of the
  /// rotation on KITTI.
  double least_error_ratio = 0.0;
};

/// Throws ConfigError if `config` is out of bounds.
[[nodiscard]] MotionModel motion_model(const SensorRig& rig, const VioConfig& config);

/// Noise densities of the acceleration and of the angular acceleration, see VioConfig.
struct MotionNoise {
  double accel = 0.0;  ///< VioConfig::motion_accel
  double turn = 0.0;   ///< VioConfig::motion_turn
};

/// Noise of the virtual sensor for a factor over `dt_s`.
[[nodiscard]] ImuNoise virtual_imu_noise(const MotionNoise& motion, double dt_s);

/// Noise of the motion that images have shown in the last seconds. It is the prior for images that
/// show no motion. VioConfig allows for more, so that the prior does not affect other images.
///
/// A velocity that changes by dv in dt has the density |dv| / sqrt(3 dt), each axis. The density is
/// the root mean square over kTimeConstant_s. Five true flights of EuRoC and three walks of TUM-VI
/// were extrapolated over 0.1 to 0.3 s. Position has 0.8 to 6.2 times the variance by this density,
/// and rotation 1.5 to 5.6 times. Hence kCaution.
class ShownMotion {
 public:
  static constexpr double kTimeConstant_s = 3.0;
  static constexpr double kCaution = 2.0;

  /// Adds the states at a former and at the newest image, `dt_s` after the image before it.
  void add(const OdometryState& former, const OdometryState& newest, double dt_s);

  /// kCaution times the measured noise, at most `most`.
  [[nodiscard]] MotionNoise noise(const MotionNoise& most) const;

 private:
  double seconds_ = 0.0;             // all images so far
  double accel_ = 0.0, turn_ = 0.0;  // mean squares
};

/// Samples of the virtual sensor that cover `from` to `to`.
[[nodiscard]] std::vector<ImuSample> virtual_samples(Stamp from, Stamp to);

/// State at an image without inertial sensor from the state at the image before, by the motion on
/// which the features agree (TrackedFrame::T_previous_current). Precondition: `tracked` has one.
[[nodiscard]] OdometryState moved_by_images(const OdometryState& before,
                                            const TrackedFrame& tracked, const SE3& T_body_left);

/// Attitude R_odom_body at a start without gravity: x of odom is the viewing direction of the left
/// camera, z its upward direction.
[[nodiscard]] Eigen::Matrix3d level_with_camera(const SE3& T_body_left);

}  // namespace km
