#pragma once

#include <span>
#include <vector>

#include "modules/core/frame.hpp"
#include "modules/core/stamped_pose.hpp"

namespace km {

/// Recorded poses with rotations that turn as the gyroscope did.
struct SteadiedPoses {
  std::vector<StampedPose> poses;       ///< Those given, with other rotations.
  double rms_rad = 0.0, max_rad = 0.0;  ///< How far they were turned.
  Eigen::Vector3d gyro_bias_radps = Eigen::Vector3d::Zero();  ///< Constant; found on the way.
};

/// Takes out of `poses`, T_world_body ascending in time, how their rotations tremble beyond what
/// the gyroscope at the body felt: motion capture is off by milliradians, by others half a second
/// later, and images along such poses contradict a gyroscope that drifts by as much in ten. With
/// M_k the rotations given, G_k what the gyroscope turned by from pose k to the next, less its
/// bias, and w_k = log(M_{k+1} (M_k G_k)^T), the result Exp(d_k) M_k minimises to first order
///   sum rho(|d_k|^2 / noise_rad^2) + sum |d_{k+1} - d_k + w_k|^2 / (gyro_noise^2 (t_{k+1} - t_k)),
/// where rho is Cauchy's, by reweighted least squares. Errors of neighbours count as independent:
/// `noise_rad` is that of one pose times the root of how many poses have about the same. Pairs of
/// poses that inertial samples do not span are not joined. O(poses log samples).
[[nodiscard]] SteadiedPoses steady_rotations(std::span<const StampedPose> poses,
                                             std::span<const ImuSample> imu,
                                             double noise_rad = 0.02,
                                             double gyro_noise = 3e-4);  // rad/sqrt(s)

}  // namespace km
