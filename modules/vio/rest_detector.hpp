#pragma once

#include <optional>

#include "modules/vio/fixed_lag_smoother.hpp"
#include "modules/vio/vio_config.hpp"

namespace km {

/// Largest image motion, and largest change of the mean accelerometer and gyroscope, of a body at
/// rest. At the start they count over the images held back and between their halves, later over
/// VioConfig::rest_s and against the estimate.
inline constexpr double kRestParallax_px = 1.0;
inline constexpr double kRestAccel_mps2 = 0.5;
inline constexpr double kRestGyro_radps = 0.05;

/// Median distance that the features common to both images have moved [px]; nullopt if there are
/// fewer than 15.
[[nodiscard]] std::optional<double> image_motion_px(const TrackedFrame& a, const TrackedFrame& b,
                                                    double focal_px);

/// Detects that a body stands still. All of three conditions are required: every image agrees with
/// the first one at rest, the samples show neither rotation nor acceleration, and the estimated
/// speed is low. Images alone would report rest when the camera delivers a frozen image or shows an
/// object that moves along with the body. Samples alone would report rest during smooth motion. Not
/// thread-safe.
class RestDetector {
 public:
  /// `focal_px`: focal length of the left camera.
  RestDetector(const VioConfig& config, double focal_px) : config_(config), focal_px_(focal_px) {}

  /// Takes the next image, with the samples since the image before and the estimated state.
  /// True if the body has stood still for VioConfig::rest_s.
  [[nodiscard]] bool add(const InertialFrame& frame, const OdometryState& state);

 private:
  void filter(const InertialFrame& frame, const OdometryState& state);

  VioConfig config_;
  double focal_px_;
  TrackedFrame first_;  // Features of the first image without motion.
  bool rests_ = false;
  std::optional<Stamp> last_sample_;
  // Smoothed difference of the samples from those of a body at rest, over kSmoothing_s.
  Eigen::Vector3d gyro_ = Eigen::Vector3d::Zero(), accel_ = Eigen::Vector3d::Zero();
};

}  // namespace km
