#include <Eigen/LU>

#include "modules/core/data/covariance.hpp"
#include "modules/loop_closure/verifier.hpp"
#include "test/modules/loop_closure/synthetic_keyframes.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

const ImageNoise kNoise;

TEST_CASE("the verifier recovers the pose of the bodies") {
  const auto seed = GENERATE(range(1U, 11U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const KeyframePair pair = make_keyframe_pair(rng, 200, kNoise, 1.0);
  const Verification result = Verifier({}).verify(pair.from, pair.to);
  REQUIRE(result.status == VerificationStatus::kAccepted);
  CHECK(result.matches == 200);
  CHECK(result.inliers >= 170);  // 1 % of the inliers fail their test, a few leave the circle
  CHECK(is_covariance(result.covariance));
  const Vector6 xi = se3_log(result.T_from_to.inverse() * pair.T_from_to);
  CHECK(xi.dot(result.covariance.inverse() * xi) < 16.8);  // 99 % quantile, and that is cautious
  CHECK(xi.head<3>().norm() < 0.01);
  CHECK(xi.tail<3>().norm() < 0.03);
  CHECK(Verifier({}).verify(pair.from, pair.to).covariance == result.covariance);
}

// Mean normalised squared error of `trials` closures whose mountings err by `mounting` [rad, m].
double mean_squared_error(double sigmas, double motion, const Vector6& mounting) {
  constexpr int kTrials = 100;
  std::mt19937 rng(5);
  double sum = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    KeyframePair pair = make_keyframe_pair(rng, 100, kNoise, sigmas, motion);
    for (KeyframeFeatures* features : {&pair.from, &pair.to}) {
      const Vector6 error = mounting.cwiseProduct(random_vector<6>(rng));
      features->T_body_cam = se3_exp(error) * features->T_body_cam;
      features->mounting = mounting.cwiseAbs2().asDiagonal();
    }
    const Verification result = Verifier({}).verify(pair.from, pair.to);
    REQUIRE(result.status == VerificationStatus::kAccepted);
    const Vector6 xi = se3_log(result.T_from_to.inverse() * pair.T_from_to);
    sum += xi.dot(result.covariance.inverse() * xi) / 6.0;
  }
  return sum / kTrials;
}

// The mean of 600 squares has a standard deviation of 6 %. Errors of the points are independent
// here, and the covariance allows for three times their variance.
TEST_CASE("the covariance of a closure follows the noise of its keypoints") {
  const double sigmas = GENERATE(0.4, 0.7, 1.0);
  CAPTURE(sigmas);
  CHECK(3.0 * mean_squared_error(sigmas, 0.0, Vector6::Zero()) == Approx(1.0).margin(0.2));
}

TEST_CASE("the covariance of a closure contains that of the mounting of both cameras") {
  Vector6 mounting;
  mounting << 0.01, 0.02, 0.01, 0.03, 0.02, 0.01;
  CHECK(mean_squared_error(0.4, 0.15, mounting) == Approx(1.0).margin(0.2));
}

TEST_CASE("a keypoint that is not a number is no inlier") {
  std::mt19937 rng(2);
  KeyframePair pair = make_keyframe_pair(rng, 100, kNoise, 0.0);
  pair.to.keypoints[7].bearing.x() = std::nanf("");
  pair.from.keypoints[9].inverse_depth = std::nanf("");
  const Verification result = Verifier({}).verify(pair.from, pair.to);
  REQUIRE(result.status == VerificationStatus::kAccepted);
  CHECK(result.inliers >= 97);
  CHECK(result.inliers < 100);
  CHECK(is_covariance(result.covariance));
}

TEST_CASE("keyframes of different places are refused") {
  std::mt19937 rng(3);
  const KeyframePair here = make_keyframe_pair(rng, 300, kNoise, 1.0);
  const KeyframePair there = make_keyframe_pair(rng, 300, kNoise, 1.0);
  CHECK(Verifier({}).verify(here.from, there.to).status == VerificationStatus::kTooFewMatches);
}

TEST_CASE("similar images of different shape have no consensus") {
  std::mt19937 rng(4);
  KeyframePair pair = make_keyframe_pair(rng, 100, kNoise, 1.0);
  std::shuffle(pair.to.keypoints.begin(), pair.to.keypoints.end(), rng);  // descriptors stay
  const Verification result = Verifier({}).verify(pair.from, pair.to);
  CHECK(result.status == VerificationStatus::kNoConsensus);
  CHECK(result.matches == 100);
  CHECK(result.consensus < Verifier::kMinConsensus);
}

TEST_CASE("a closure that depends on a small far patch is refused") {
  std::mt19937 rng(5);
  KeyframePair pair = make_keyframe_pair(rng, 60, kNoise, 0.0);
  for (KeyframeFeatures* features : {&pair.from, &pair.to})
    for (Keypoint& keypoint : features->keypoints) {
      keypoint.bearing *= 0.1F;
      keypoint.inverse_depth = 0.08F;  // 12.5 m away, all of it
    }
  pair.to.keypoints = pair.from.keypoints;
  CHECK(Verifier({}).verify(pair.from, pair.to).status == VerificationStatus::kUncertainPose);
}

TEST_CASE("too few inliers are refused by number") {
  std::mt19937 rng(6);
  const KeyframePair pair = make_keyframe_pair(rng, 14, kNoise, 0.3);
  LoopClosureConfig config;
  CHECK(Verifier(config).verify(pair.from, pair.to).status == VerificationStatus::kTooFewInliers);
  config.min_inliers = 6;
  CHECK(Verifier(config).verify(pair.from, pair.to).status != VerificationStatus::kTooFewInliers);
}

TEST_CASE("keyframes without features or without depth are refused") {
  std::mt19937 rng(7);
  KeyframePair pair = make_keyframe_pair(rng, 50, kNoise, 0.0);
  CHECK(Verifier({}).verify({}, {}).status == VerificationStatus::kTooFewMatches);
  CHECK(Verifier({}).verify({}, pair.to).status == VerificationStatus::kTooFewMatches);
  for (KeyframeFeatures* features : {&pair.from, &pair.to})
    for (Keypoint& keypoint : features->keypoints) keypoint.inverse_depth = 0.0F;
  const Verification result = Verifier({}).verify(pair.from, pair.to);
  CHECK(result.status == VerificationStatus::kTooFewMatches);
  CHECK(result.matches == 0);
}

}  // namespace
}  // namespace km
