#pragma once

#include <span>
#include <vector>

#include "modules/core/geometry.hpp"

namespace km {

/// Optimised poses of all keyframes of `T_odom_kf`. Keyframes at the end that `T_world_kf` lacks
/// follow its last pose by odometry. There are never more poses than in odometry, and at least one
/// unless odometry has none.
[[nodiscard]] std::vector<SE3> complete(std::span<const SE3> T_odom_kf,
                                        std::span<const SE3> T_world_kf);

/// Smallest change of a pose that counts.
struct MotionScale {
  double translation_m = 0.01;
  double rotation_rad = 0.005;
};

/// Motion of the keyframes from one solution to the next.
struct KeyframeMotion {
  SE3 T_after_before = SE3::Identity();  ///< Common motion, mostly of the gauge.
  double non_rigid = 0.0;  ///< Largest motion relative to the common one, in units of the scale.
};

/// Compares two solutions of the same keyframes, as many as both have. The common motion minimises
/// the sum of the squared motions relative to it, in units of `scale`, with the chordal distance of
/// rotations. This is the orthogonal Procrustes problem (Umeyama, PAMI 1991) with rotations as
/// further observations, so that one pose suffices. Without poses it is the identity.
[[nodiscard]] KeyframeMotion keyframe_motion(std::span<const SE3> before,
                                             std::span<const SE3> after, const MotionScale& scale);

/// Largest difference between T_a * pose and T_b * pose of any of the poses, in units of the scale.
[[nodiscard]] double largest_difference(std::span<const SE3> poses, const SE3& T_a, const SE3& T_b,
                                        const MotionScale& scale);

}  // namespace km
