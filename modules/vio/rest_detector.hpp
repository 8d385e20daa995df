#pragma once

#include <optional>

#include "modules/vio/fixed_lag_smoother.hpp"
#include "modules/vio/vio_config.hpp"

namespace km {

/// Median distance of the features seen in both images [px]; nullopt if they are too few to tell.
[[nodiscard]] std::optional<double> image_motion_px(const TrackedFrame& a, const TrackedFrame& b,
                                                    double focal_px);

/// Tells when a body stands still: every image shows what the first did, the samples are those of a
/// body that neither turns nor gains speed, and the estimate is slow. It takes all three. Images
/// alone would take for rest what a camera shows that hangs, or looks at what moves along with it;
/// samples alone, a smooth ride. Not thread-safe.
class RestDetector {
 public:
  /// `focal_px`: of the left camera.
  RestDetector(const VioConfig& config, double focal_px) : config_(config), focal_px_(focal_px) {}

  /// Takes the next image, with the samples since the one before and the estimate there. True if
  /// the body has stood still for VioConfig::rest_s.
  [[nodiscard]] bool add(const InertialFrame& frame, const OdometryState& state);

 private:
  void filter(const InertialFrame& frame, const OdometryState& state);

  VioConfig config_;
  double focal_px_;
  TrackedFrame first_;  // Of those that show the same.
  bool rests_ = false;
  std::optional<Stamp> last_sample_;
  // What the sensors measure beyond what they would of a body at rest, over kSmoothing_s.
  Eigen::Vector3d gyro_ = Eigen::Vector3d::Zero(), accel_ = Eigen::Vector3d::Zero();
};

}  // namespace km
