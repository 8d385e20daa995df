#pragma once

#include "modules/core/data/keyframe.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/loop_closure/loop_closure_config.hpp"

namespace km {

/// Result of a verification: accepted, or the first test that failed.
enum class VerificationStatus {
  kAccepted,
  kTooFewMatches,  ///< Too few keypoints of the two images have similar descriptors.
  kNoConsensus,    ///< Too few matches agree on any pose.
  kDegenerate,     ///< The matches leave the pose undetermined (few points, on a line).
  kTooFewInliers,  ///< Too few correspondences support the refined pose.
  kUncertainPose,  ///< The pose is too uncertain without the inliers that determine it most.
};

/// "accepted", "too few matches", ...
const char* to_string(VerificationStatus status);

/// A verified closure or the reason of the rejection, with the numbers behind it. Numbers of steps
/// that were not reached are zero.
struct Verification {
  VerificationStatus status = VerificationStatus::kTooFewMatches;
  SE3 T_from_to = SE3::Identity();           ///< Relative pose of the bodies, if accepted.
  Matrix6 covariance = Matrix6::Identity();  ///< Covariance of T_from_to, see
                                             ///< modules/core/data/covariance.hpp.
  int matches = 0;     ///< Pairs of similar keypoints, at least one with depth.
  int consensus = 0;   ///< Matches that agree with the best sampled pose.
  int iterations = 0;  ///< Number of samples drawn.
  int inliers = 0;     ///< Correspondences that support the refined pose.
  /// Standard deviations of the pose without the inliers that determine it most: root of the sum of
  /// the variances of three axes.
  double position_sigma_m = 0.0;
  double rotation_sigma_rad = 0.0;
};

/// Geometric verification of loop closures: computes the relative pose of the bodies of two
/// keyframes with its covariance, or the reason of the rejection.
///
///  1. Matches by descriptor alone (match_descriptors()).
///  2. The pose with which most matches agree (ransac_pose(); Chang et al., "Kimera-Multi", ICRA
///     2021, Sec. III-A).
///  3. Matches near the projections under this pose, within a decreasing radius, and refinement on
///     the inliers. Most correspondences are found in this step, because similar corners elsewhere
///     are excluded.
///  4. Tests of the number of inliers and of the uncertainty (VerificationStatus).
///
/// The covariance is that of the refinement, scaled to the residuals, times a factor for common
/// errors of neighbouring points. It includes the errors of the calibration's scale and of the
/// mounting of both cameras.
///
/// Deterministic: equal features give equal results. verify() is safe to call from several threads.
class Verifier {
 public:
  /// Least number of matches, made without knowing the pose, that agree with the pose. About ten
  /// may agree by chance.
  static constexpr int kMinConsensus = 12;

  /// Throws ConfigError if `config` is out of bounds.
  explicit Verifier(const LoopClosureConfig& config);

  [[nodiscard]] Verification verify(const KeyframeFeatures& from, const KeyframeFeatures& to) const;

 private:
  LoopClosureConfig config_;
};

}  // namespace km
