#pragma once

#include <span>
#include <vector>

#include "modules/core/frame.hpp"
#include "modules/core/stamped_pose.hpp"

namespace km {

/// Recorded poses with rotations corrected by the gyroscope.
struct SteadiedPoses {
  std::vector<StampedPose> poses;       ///< The given poses with corrected rotations.
  double rms_rad = 0.0, max_rad = 0.0;  ///< Size of the corrections.
  Eigen::Vector3d gyro_bias_radps = Eigen::Vector3d::Zero();  ///< Estimated constant bias.
};

/// Removes the fast errors of the rotations of `poses`, T_world_body ascending in time, that the
/// gyroscope does not show. Motion capture is wrong by milliradians that change within half a
/// second. Images along such poses contradict a gyroscope, which drifts by the same amount in ten
/// seconds. M_k are the given rotations. G_k is the turn of the gyroscope from pose k to the next,
/// less its bias, and w_k = log(M_{k+1} (M_k G_k)^T). The result Exp(d_k) M_k minimises to first
/// order
///   sum rho(|d_k|^2 / noise_rad^2) + sum |d_{k+1} - d_k + w_k|^2 / (gyro_noise^2 (t_{k+1} - t_k)),
/// with Cauchy's rho, by reweighted least squares. Errors of neighbours count as independent, so
/// `noise_rad` is that of one pose times the root of the number of poses with about the same error.
/// Pairs of poses that inertial samples do not span are not connected. O(poses log samples).
[[nodiscard]] SteadiedPoses steady_rotations(std::span<const StampedPose> poses,
                                             std::span<const ImuSample> imu,
                                             double noise_rad = 0.02,
                                             double gyro_noise = 3e-4);  // rad/sqrt(s)

}  // namespace km
