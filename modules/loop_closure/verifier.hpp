#pragma once

#include "modules/core/geometry.hpp"
#include "modules/core/keyframe.hpp"
#include "modules/loop_closure/loop_closure_config.hpp"

namespace km {

/// Result of a verification: accepted, or the first test that failed.
enum class VerificationStatus {
  kAccepted,
  kTooFewMatches,  ///< The images do not look alike.
  kNoConsensus,    ///< Too few matches agree on any pose.
  kDegenerate,     ///< The matches leave the pose undetermined (few points, on a line).
  kTooFewInliers,  ///< Too few correspondences support the refined pose.
  kPoorlyHeld,     ///< Without its strongest inliers the pose would be too uncertain.
};

/// "accepted", "too few matches", ...
const char* to_string(VerificationStatus status);

/// A verified closure or the reason of the rejection, with the numbers behind it. Numbers of steps
/// that were not reached are zero.
struct Verification {
  VerificationStatus status = VerificationStatus::kTooFewMatches;
  SE3 T_from_to = SE3::Identity();           ///< Relative pose of the bodies; set if accepted, like
                                             ///< covariance.
  Matrix6 covariance = Matrix6::Identity();  ///< Covariance of T_from_to, see
                                             ///< modules/core/covariance.hpp.
  int matches = 0;                  ///< Pairs of similar descriptors, at least one of them with
                                    ///< depth.
  int consensus = 0;                ///< Matches that agree with the best sampled pose.
  int iterations = 0;               ///< Number of samples drawn.
  int inliers = 0;                  ///< Correspondences found with the known pose that support it.
  double position_sigma_m = 0.0;    ///< Without the strongest inliers; all three axes together.
  double rotation_sigma_rad = 0.0;  ///< Without the strongest inliers; all three axes together.
};

/// Geometric verification of loop closures: computes the relative pose of the bodies of two
/// keyframes with its covariance, or the reason of the rejection.
///
///  1. Matches by descriptor alone (match_descriptors()).
///  2. A pose with which many of them agree (ransac_pose(); Chang et al., "Kimera-Multi", ICRA
///     2021,
///     Sec. III-A).
///  3. Matching again near the predicted places, in narrowing circles, and refinement on the
///     inliers.
///     Most correspondences are found in this step, because similar corners elsewhere are excluded.
///  4. Tests, each against an error that was seen on recorded images.
///
/// The covariance is that of the refinement (both images' noise, scaled up if the residuals are
/// larger), times a factor for common errors of neighbouring points, plus systematic errors.
///
/// Deterministic: equal features give equal results. verify() is safe to call from several threads.
class Verifier {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  explicit Verifier(const LoopClosureConfig& config);

  [[nodiscard]] Verification verify(const KeyframeFeatures& from, const KeyframeFeatures& to) const;

 private:
  LoopClosureConfig config_;
};

}  // namespace km
