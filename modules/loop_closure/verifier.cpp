#include "modules/loop_closure/verifier.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include "modules/core/data/covariance.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/loop_closure/matching.hpp"
#include "modules/loop_closure/relative_pose.hpp"

namespace km {
namespace {

constexpr int kRefineIterations = 5;

// Radii of the successive guided matchings [px].
constexpr double kGuidedRadii_px[] = {8.0, 5.6, 3.9};

// Share of the inliers, those that determine the pose most, without which the pose is tested.
constexpr double kStrongestShare = 0.15;

// Ratio of the variance of the pose to that under independent errors of the points. Errors of
// neighbouring points are correlated. Chosen on V1_01, kitti_sequence_1 and tartanair_hospital:
// with 1 % as the scale, the medians of their normalised squared errors, relative to chi-squared,
// are 0.8, 1.0 and 1.6.
constexpr double kCommonErrors = 3.0;

// Least ratio of the measured to the assumed variance of keypoints: messages round them.
constexpr double kLeastNoise = 0.1;

std::vector<ImagePair> pairs_of(const std::vector<Match>& matches, const KeyframeFeatures& from,
                                const KeyframeFeatures& to) {
  const ImageNoise noise;
  std::vector<ImagePair> pairs;
  pairs.reserve(matches.size());
  for (const Match& match : matches) {
    const ImagePair pair{image_point(from, match.a, noise), image_point(to, match.b, noise)};
    if (pair.a.has_depth || pair.b.has_depth) pairs.push_back(pair);
  }
  return pairs;
}

std::vector<std::size_t> inliers_of(const SE3& T_a_b, const std::vector<ImagePair>& pairs) {
  std::vector<std::size_t> inliers;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (pair_error(T_a_b, pairs[i]).relative() <= 1.0) inliers.push_back(i);
  return inliers;
}

// A pose of the cameras and all correspondences that support it.
struct Support {
  PoseFit fit;
  std::vector<ImagePair> pairs;
  std::vector<std::size_t> inliers;
};

std::optional<Support> gather_support(const PoseFit& start, const KeyframeFeatures& from,
                                      const KeyframeFeatures& to) {
  Support support{start, {}, {}};
  const auto refine = [&] {
    support.inliers = inliers_of(support.fit.T_a_b, support.pairs);
    const std::optional<PoseFit> fit =
        refine_pose(support.fit.T_a_b, support.pairs, support.inliers, kRefineIterations);
    if (fit) support.fit = *fit;
    return fit.has_value();
  };
  for (const double radius_px : kGuidedRadii_px) {
    support.pairs =
        pairs_of(match_guided(support.fit.T_a_b, from, to, {.radius_px = radius_px}), from, to);
    if (!refine()) return std::nullopt;
  }
  if (!refine()) return std::nullopt;
  return support;
}

// Covariance of the bodies' relative pose from information in the cameras'.
// T_body_a body_b exp(Ad(T_body_cam_b) xi) = T_body_cam_a T_a_b exp(xi) T_body_cam_b^-1.
Matrix6 body_covariance(const Matrix6& information, const SE3& T_body_cam) {
  const Matrix6 Ad = adjoint(T_body_cam);
  return Ad * information.ldlt().solve(Matrix6::Identity()) * Ad.transpose();
}

bool holds(const Matrix6& information) {
  constexpr double kLeastPivotRatio = 1e-12;
  const Eigen::LDLT<Matrix6> ldlt(information);
  const auto pivots = ldlt.vectorD();
  return ldlt.info() == Eigen::Success && pivots.minCoeff() > kLeastPivotRatio * pivots.maxCoeff();
}

}  // namespace

const char* to_string(VerificationStatus status) {
  // In the order of the enumerators.
  constexpr std::array kWords = {
      "accepted",
      "too few matches",
      "matches do not agree on a pose",
      "matches leave the pose undetermined",
      "too few inliers",
      "the pose depends on a few inliers: without them its standard deviation exceeds "
      "max_position_sigma_m or max_rotation_sigma_rad, or the smaller bound inside a robot"};
  return kWords[static_cast<std::size_t>(status)];
}

Verifier::Verifier(const LoopClosureConfig& config) : config_(checked(config)) {}

Verification Verifier::verify(const KeyframeFeatures& from, const KeyframeFeatures& to) const {
  Verification result;
  const auto refused = [&](VerificationStatus status) {
    result.status = status;
    return result;
  };
  const std::vector<ImagePair> pairs = pairs_of(match_descriptors(from, to, {}), from, to);
  result.matches = static_cast<int>(pairs.size());
  if (result.matches < kMinConsensus) return refused(VerificationStatus::kTooFewMatches);

  std::mt19937 rng(config_.seed);
  const RansacResult consensus = ransac_pose(pairs, {}, rng);
  result.consensus = static_cast<int>(consensus.inliers.size());
  result.iterations = consensus.iterations;
  if (!consensus.T_a_b || result.consensus < kMinConsensus)
    return refused(VerificationStatus::kNoConsensus);

  const std::optional<PoseFit> start =
      refine_pose(*consensus.T_a_b, pairs, consensus.inliers, kRefineIterations);
  if (!start) return refused(VerificationStatus::kDegenerate);
  const std::optional<Support> support = gather_support(*start, from, to);
  if (!support) return refused(VerificationStatus::kDegenerate);
  result.inliers = static_cast<int>(support->inliers.size());
  if (result.inliers < config_.min_inliers) return refused(VerificationStatus::kTooFewInliers);

  const PoseFit& fit = support->fit;
  const double misfit = fit.chi2 / std::max(1.0, fit.degrees_of_freedom - 6.0);
  const double scale = misfit <= 1.0 ? 1.0 : misfit;  // NaN stays NaN
  const Matrix6 weakened =
      information_without_strongest(fit, support->pairs, support->inliers, kStrongestShare);
  if (!holds(weakened)) return refused(VerificationStatus::kUncertainPose);
  const Matrix6 weak = scale * body_covariance(weakened, to.T_body_cam);
  result.rotation_sigma_rad = std::sqrt(weak.topLeftCorner<3, 3>().trace());
  result.position_sigma_m = std::sqrt(weak.bottomRightCorner<3, 3>().trace());
  if (!(result.rotation_sigma_rad <= config_.max_rotation_sigma_rad &&
        result.position_sigma_m <= config_.max_position_sigma_m))
    return refused(VerificationStatus::kUncertainPose);

  const double noise = std::max(kLeastNoise, misfit);
  result.T_from_to = from.T_body_cam * fit.T_a_b * to.T_body_cam.inverse();
  result.covariance = kCommonErrors * noise * body_covariance(fit.information, to.T_body_cam) +
                      calibration_covariance(result.T_from_to, from.depth_source) + from.mounting;
  // Both mountings are uncertain. That of a peer is unknown and counts as that of `from`.
  result.covariance =
      compose({SE3::Identity(), from.mounting}, {result.T_from_to, result.covariance}).Sigma;
  result.covariance = 0.5 * (result.covariance + result.covariance.transpose()).eval();
  result.status = VerificationStatus::kAccepted;
  return result;
}

}  // namespace km
