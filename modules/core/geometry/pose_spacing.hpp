#pragma once

#include <optional>

#include "modules/core/geometry/geometry.hpp"

namespace km {

/// Chooses poses of a moving camera: each is at least 0.3 m or 15 degrees from the one before.
class PoseSpacing {
 public:
  /// True if the pose is chosen. The first one is.
  bool choose(const SE3& T_odom_cam) {
    if (T_odom_last_) {
      const SE3 motion = T_odom_last_->inverse() * T_odom_cam;
      if (motion.translation().norm() < kMotion_m && angle_of(motion.linear()) < kMotion_rad)
        return false;
    }
    T_odom_last_ = T_odom_cam;
    return true;
  }

 private:
  static constexpr double kMotion_m = 0.3, kMotion_rad = 0.26;

  std::optional<SE3> T_odom_last_;
};

}  // namespace km
