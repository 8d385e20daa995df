#pragma once

#include <cstddef>

#include "modules/core/data/keyframe.hpp"
#include "modules/core/geometry/geometry.hpp"

namespace km {

/// True if all numbers are equal.
[[nodiscard]] inline bool operator==(const OdometryPose& a, const OdometryPose& b) {
  return a.id == b.id && a.T_odom_kf.matrix() == b.T_odom_kf.matrix() &&
         a.covariance == b.covariance;
}

/// A keyframe from which surface was seen, and its pose in `world`.
struct SurfaceKeyframe {
  OdometryPose odometry;
  SE3 T_world_kf = SE3::Identity();

  [[nodiscard]] bool operator==(const SurfaceKeyframe& other) const {
    return odometry == other.odometry && T_world_kf.matrix() == other.T_world_kf.matrix();
  }
};

/// Bytes of a SurfaceKeyframe on the wire, with padding.
inline constexpr std::size_t kSurfaceKeyframeBytes = 188;

}  // namespace km
