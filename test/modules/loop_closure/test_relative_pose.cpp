#include "modules/core/geometry/lie.hpp"
#include "modules/core/geometry/symmetric_eigen.hpp"
#include "modules/loop_closure/keyframe_features.hpp"
#include "modules/loop_closure/relative_pose.hpp"
#include "test/modules/loop_closure/synthetic_keyframes.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

std::vector<ImagePair> image_pairs(const KeyframePair& keyframes, const ImageNoise& noise) {
  std::vector<ImagePair> pairs;
  for (std::size_t i = 0; i < keyframes.from.keypoints.size(); ++i)
    pairs.push_back({image_point(keyframes.from, i, noise), image_point(keyframes.to, i, noise)});
  return pairs;
}

std::vector<std::size_t> all_of(const std::vector<ImagePair>& pairs) {
  std::vector<std::size_t> indices(pairs.size());
  std::iota(indices.begin(), indices.end(), std::size_t{0});
  return indices;
}

SE3 camera_pose(const KeyframePair& keyframes) {
  return keyframes.from.T_body_cam.inverse() * keyframes.T_from_to * keyframes.to.T_body_cam;
}

TEST_CASE("points on a line, in one place, or too few have no alignment") {
  std::vector<Eigen::Vector3d> points;
  SECTION("a line") {
    for (int i = 0; i < 10; ++i) points.emplace_back(0.1 * i + 0.1, 0.1 * i + 0.2, 0.1 * i + 0.3);
  }
  SECTION("one place") {
    points.assign(5, Eigen::Vector3d(1, 2, 3));
  }
  SECTION("two points") {
    points = {{0, 0, 1}, {1, 0, 1}};
  }
  CHECK_THROWS_AS(align_points(points, {}), std::invalid_argument);
  CHECK_FALSE(align_points(points, points));
}

TEST_CASE("refinement reaches the truth of points without noise") {
  const auto seed = GENERATE(range(1U, 6U));
  const bool one_sided = GENERATE(false, true);
  CAPTURE(seed, one_sided);
  std::mt19937 rng(seed);
  const KeyframePair keyframes = make_keyframe_pair(rng, 30, {}, 0.0);
  std::vector<ImagePair> pairs = image_pairs(keyframes, {});
  if (one_sided)  // half the pairs have depth only in a, half only in b
    for (std::size_t i = 0; i < pairs.size(); ++i)
      (i % 2 == 0 ? pairs[i].a : pairs[i].b).has_depth = false;
  const SE3 T_a_b = camera_pose(keyframes);
  const SE3 start = T_a_b * se3_exp(0.03 * Vector6::Ones());
  const auto fit = refine_pose(start, pairs, all_of(pairs), 20);
  REQUIRE(fit);
  CHECK(se3_log(T_a_b.inverse() * fit->T_a_b).norm() < 1e-6);  // keypoints are floats
}

TEST_CASE("RANSAC finds the pose and the inliers among 70 % outliers") {
  const auto seed = GENERATE(range(1U, 6U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const ImageNoise noise{0.7, 0.3};
  const KeyframePair keyframes = make_keyframe_pair(rng, 100, noise, 1.0);
  std::vector<ImagePair> pairs = image_pairs(keyframes, noise);
  constexpr std::size_t kInliers = 30;
  for (std::size_t i = kInliers; i < pairs.size(); ++i)  // partners changed in a circle
    pairs[i].b = image_point(keyframes.to, i + 1 < pairs.size() ? i + 1 : kInliers, noise);

  std::mt19937 draws(7);
  const RansacResult result = ransac_pose(pairs, {0.999, 5000}, draws);
  REQUIRE(result.T_a_b);
  const Vector6 error = se3_log(camera_pose(keyframes).inverse() * *result.T_a_b);
  CHECK(error.head<3>().norm() < 0.03);  // 0.7 px over 458 px, 30 points: 3 sigma is below 0.01
  CHECK(error.tail<3>().norm() < 0.08);
  const auto true_inliers = std::count_if(result.inliers.begin(), result.inliers.end(),
                                          [](std::size_t i) { return i < kInliers; });
  CHECK(true_inliers >= 27);  // the test keeps 99 % of them
  CHECK(static_cast<std::size_t>(true_inliers) + 3 >= result.inliers.size());
  for (std::size_t i = 0; i < pairs.size(); ++i)
    CHECK(std::ranges::binary_search(result.inliers, i) ==
          (pair_error(*result.T_a_b, pairs[i]).relative() <= 1.0));
}

// 400 trials: 95 % of a chi-squared variable lie below its quantile, with a standard deviation of
// 1.1 %. Cauchy weights make the information a little too small: a few more are inside.
TEST_CASE("errors of the refined pose have the covariance it claims") {
  const ImageNoise noise{0.7, 0.3};
  constexpr int kTrials = 400;
  constexpr double kQuantile95 = 12.592;  // 6 degrees of freedom
  int inside = 0;
  double sum = 0.0;
  std::mt19937 rng(11);
  for (int trial = 0; trial < kTrials; ++trial) {
    const KeyframePair keyframes = make_keyframe_pair(rng, 60, noise, 1.0);
    const std::vector<ImagePair> pairs = image_pairs(keyframes, noise);
    const SE3 T_a_b = camera_pose(keyframes);
    const auto fit = refine_pose(T_a_b, pairs, all_of(pairs), 10);
    REQUIRE(fit);
    const Vector6 xi = se3_log(fit->T_a_b.inverse() * T_a_b);
    const double chi2 = xi.dot(fit->information * xi);
    inside += chi2 < kQuantile95 ? 1 : 0;
    sum += chi2 / kTrials;
  }
  CHECK(inside >= 0.92 * kTrials);
  CHECK(sum > 3.5);  // expected 6 with plain weights; Cauchy takes a quarter of the information
  CHECK(sum < 6.6);
}

// Disparities of 8 to 25 px with 2 px of noise: linearised about the measurement itself, refinement
// finds 3 % too little motion.
TEST_CASE("noise of the depths does not shorten the motion") {
  const ImageNoise noise{0.7, 2.0};
  constexpr int kTrials = 100;
  std::mt19937 rng(17);
  double along = 0.0, square = 0.0, spread = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const KeyframePair keyframes = make_keyframe_pair(rng, 300, noise, 1.0);
    const std::vector<ImagePair> pairs = image_pairs(keyframes, noise);
    const SE3 T_a_b = camera_pose(keyframes);
    const auto fit = refine_pose(T_a_b, pairs, all_of(pairs), 10);
    REQUIRE(fit);
    const Eigen::Vector3d t = T_a_b.translation();
    const double excess = t.dot(fit->T_a_b.translation() - t);
    along += excess;
    spread += excess * excess;
    square += t.squaredNorm();
  }
  const double standard_error = std::sqrt(spread) / square;
  CAPTURE(along / square, standard_error);
  CHECK(std::abs(along / square) < 3.0 * standard_error);
  CHECK(standard_error < 0.005);  // or the test could not see the bias
}

TEST_CASE("a pose held by two points loses its information with them") {
  std::mt19937 rng(2);
  const ImageNoise noise{0.7, 0.3};
  const KeyframePair keyframes = make_keyframe_pair(rng, 40, noise, 0.0);
  std::vector<ImagePair> pairs = image_pairs(keyframes, noise);
  const SE3 T_a_b = camera_pose(keyframes);
  // All but the first two are the same point, seen from nearly one direction.
  for (std::size_t i = 3; i < pairs.size(); ++i) pairs[i] = pairs[2];
  const auto fit = refine_pose(T_a_b, pairs, all_of(pairs), 0);
  REQUIRE(fit);
  const Matrix6 left = information_without_strongest(*fit, pairs, all_of(pairs), 0.01);
  CHECK(symmetric_eigen(left).values(0) < 1e-6 * symmetric_eigen(fit->information).values(0));
}

TEST_CASE("RANSAC stops as soon as its confidence allows") {
  std::mt19937 rng(1);
  const KeyframePair keyframes = make_keyframe_pair(rng, 50, {}, 0.0);
  const RansacResult result = ransac_pose(image_pairs(keyframes, {}), {}, rng);
  CHECK(result.inliers.size() == 50);
  CHECK(result.iterations <= 3);  // a sample on a line gives no pose
  CHECK_FALSE(ransac_pose({}, {}, rng).T_a_b);
}

Camera camera_of(const SE3& T_body_cam) {
  Camera camera{.width = 752, .height = 480, .fx = 458.0, .fy = 458.0, .cx = 376.0, .cy = 240.0};
  camera.T_body_cam = T_body_cam;
  return camera;
}

// Pose of the body `late_s` after the identity, with a constant twist in the body frame.
SE3 moved(const Vector6& twist_body, double late_s) {
  return se3_exp(late_s * twist_body);
}

TEST_CASE("Points of a rolling shutter are where a global shutter sees them") {
  constexpr double kReadout_s = 0.0015;  // so short that terms of second order are small
  std::mt19937 rng(GENERATE(range(0U, 4U)));
  const SE3 T_body_cam = random_pose(rng);
  const Camera camera = camera_of(T_body_cam);
  Vector6 twist_body;
  twist_body << random_vector<3>(rng), 2.0 * random_vector<3>(rng);
  KeyframeFeatures features, expected;
  features.T_body_cam = T_body_cam;
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector2d seen = 0.3 * random_vector<2>(rng);
    const double late_s = kReadout_s * camera.row_time(camera.project(seen)->y());
    // A point that stands still, at a depth of 4 m when its row is exposed.
    const Eigen::Vector3d p_body =
        moved(twist_body, late_s) * (T_body_cam * (4.0 * seen.homogeneous()));
    const Eigen::Vector3d p_cam = T_body_cam.inverse() * p_body;
    features.keypoints.push_back({.bearing = seen.cast<float>(), .inverse_depth = 0.25F});
    expected.keypoints.push_back({.bearing = p_cam.hnormalized().cast<float>(),
                                  .inverse_depth = static_cast<float>(1.0 / p_cam.z())});
  }
  const KeyframeFeatures rolled = features;
  unroll(camera, kReadout_s, twist_body, features);
  double largest = 0.0;
  for (std::size_t i = 0; i < features.keypoints.size(); ++i) {
    const Keypoint& is = features.keypoints[i];
    const Keypoint& due = expected.keypoints[i];
    largest = std::max<double>(largest, (rolled.keypoints[i].bearing - due.bearing).norm());
    CHECK((is.bearing - due.bearing).norm() < 3e-5F);
    CHECK(is.inverse_depth == Approx(due.inverse_depth).epsilon(1e-4));
  }
  CHECK(largest > 5e-4);
}

TEST_CASE("A global shutter's points, and those of a camera at rest, do not move") {
  std::mt19937 rng(7);
  KeyframeFeatures features;
  features.keypoints = {{.bearing = {0.1F, -0.2F}, .inverse_depth = 0.5F}};
  const auto [readout_s, speed] = GENERATE(table<double, double>({{0.0, 1.0}, {0.03, 0.0}}));
  unroll(camera_of(SE3::Identity()), readout_s, speed * random_vector<6>(rng), features);
  CHECK(features.keypoints[0].bearing == Eigen::Vector2f(0.1F, -0.2F));
  CHECK(features.keypoints[0].inverse_depth == 0.5F);
}

}  // namespace
}  // namespace km
