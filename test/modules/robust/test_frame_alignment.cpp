#include "modules/robust/frame_alignment.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

double angle_between(const SE3& a, const SE3& b) {
  return angle_of(a.linear().transpose() * b.linear());
}

}  // namespace

TEST_CASE("ten equal candidates win over forty random ones") {
  const unsigned seed = GENERATE(range(0U, 50U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const SE3 truth = random_pose(rng);
  std::vector<SE3> candidates(10, truth);
  while (candidates.size() < 50) {
    const SE3 other = random_pose(rng);
    if (angle_between(candidates.front(), other) > 0.36) candidates.push_back(other);
  }
  const auto alignment = align_frames(candidates);
  REQUIRE(alignment);
  CHECK(angle_between(alignment->T, truth) < 1e-6);
  CHECK((alignment->T.translation() - truth.translation()).norm() < 1e-9);
  CHECK(alignment->inliers == std::vector<std::size_t>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
}

TEST_CASE("candidates count by their weights") {
  std::mt19937 rng(1);
  const SE3 few = random_pose(rng);
  const SE3 many = few * make_pose(Eigen::Matrix3d::Identity(), Eigen::Vector3d(100.0, 0.0, 0.0));
  std::vector<SE3> candidates(3, few);
  candidates.resize(10, many);
  CHECK(align_frames(candidates)->inliers.size() == 7);
  std::vector<double> weights(3, 1.0);
  weights.resize(10, 1.0 / 7.0);
  CHECK(align_frames(candidates, weights)->inliers == std::vector<std::size_t>{0, 1, 2});
  weights.back() = 0.0;
  CHECK_THROWS_AS(align_frames(candidates, weights), std::invalid_argument);
  weights.pop_back();
  CHECK_THROWS_AS(align_frames(candidates, weights), std::invalid_argument);
}

TEST_CASE("noise of the agreeing candidates averages out") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const SE3 truth = random_pose(rng);
  std::vector<SE3> candidates;
  for (int k = 0; k < 400; ++k) {
    const Eigen::Vector3d phi = 0.05 * random_vector<3>(rng);
    const Eigen::AngleAxisd R(phi.norm(), phi.normalized());
    candidates.push_back(truth * make_pose(R.toRotationMatrix(), 0.2 * random_vector<3>(rng)));
  }
  const auto alignment = align_frames(candidates);
  REQUIRE(alignment);
  CHECK(alignment->inliers.size() >= 200);
  // Five standard deviations of the mean of 200 candidates: 0.05 sqrt(3) rad, 0.2 sqrt(3) m, over
  // 14.
  CHECK(angle_between(alignment->T, truth) < 0.031);
  CHECK((alignment->T.translation() - truth.translation()).norm() < 0.123);
}

TEST_CASE("false candidates within the tolerance do not move the average") {
  const unsigned seed = GENERATE(range(1U, 11U));
  const double apart_m = GENERATE(2.0, 5.0, 9.0);
  const std::size_t wrong = GENERATE(10U, 18U);
  CAPTURE(seed, apart_m, wrong);
  std::mt19937 rng(seed);
  const SE3 truth = random_pose(rng);
  const SE3 alike = truth * make_pose(Eigen::Matrix3d::Identity(), {apart_m, 0.0, 0.0});
  std::vector<SE3> candidates;
  for (std::size_t k = 0; k < 20 + wrong; ++k)
    candidates.push_back((k < 20 ? truth : alike) *
                         make_pose(Eigen::Matrix3d::Identity(), 0.1 * random_vector<3>(rng)));
  const auto alignment = align_frames(candidates);
  REQUIRE(alignment);
  CHECK((alignment->T.translation() - truth.translation()).norm() < 0.15);
  CHECK(alignment->inliers.size() >= 14);
  CHECK(alignment->inliers.back() < 20);
}

TEST_CASE("alignment does not depend on the frame") {
  std::mt19937 rng(5);
  std::vector<SE3> candidates;
  std::vector<SE3> moved;
  const SE3 frame = random_pose(rng);
  const SE3 centre = random_pose(rng);
  for (int k = 0; k < 20; ++k) {
    const SE3 T = k % 2 == 0
                      ? centre * make_pose(Eigen::Matrix3d::Identity(), 0.1 * random_vector<3>(rng))
                      : random_pose(rng);
    candidates.push_back(T);
    moved.push_back(frame * T);
  }
  const auto plain = align_frames(candidates);
  const auto in_frame = align_frames(moved);
  REQUIRE(plain);
  REQUIRE(in_frame);
  CHECK(plain->inliers == in_frame->inliers);
  CHECK((frame * plain->T).isApprox(in_frame->T, 1e-9));
}

TEST_CASE("alignment without candidates has no result") {
  CHECK_FALSE(align_frames({}).has_value());
}

}  // namespace km
