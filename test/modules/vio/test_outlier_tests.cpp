#include "modules/core/geometry/lie.hpp"
#include "modules/vio/track_motion.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kFocalPx = 458.0;
constexpr double kNoise = 0.3 / kFocalPx;
constexpr double kThreshold = 2.0 / kFocalPx;

struct Scene {
  SE3 T_previous_current;
  std::vector<DepthPair> pairs;
  std::vector<bool> is_false;

  [[nodiscard]] std::vector<BearingPair> mono() const {
    std::vector<BearingPair> result;
    for (const DepthPair& pair : pairs) result.push_back({pair.previous, pair.current});
    return result;
  }
};

// Landmarks 1 to 8 m away; false pairs end 10 to 40 px from the truth, across the epipolar line.
Scene random_scene(std::mt19937& rng, const Vector6& twist, int pairs, double false_share) {
  std::uniform_real_distribution<double> bearing(-0.7, 0.7);
  std::uniform_real_distribution<double> depth(1.0, 8.0);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Scene scene;
  scene.T_previous_current = se3_exp(twist);
  for (int i = 0; i < pairs; ++i) {
    const double x = bearing(rng);
    const double y = bearing(rng);
    const double z = depth(rng);
    const Eigen::Vector3d p(x * z, y * z, z);
    DepthPair pair{Eigen::Vector2d(x, y), 1.0 / z,
                   (scene.T_previous_current.inverse() * p).hnormalized()};
    pair.current += kNoise * random_vector<2>(rng);
    const bool is_false = unit(rng) < false_share;
    if (is_false) {
      const Eigen::Vector2d infinity =
          (scene.T_previous_current.linear().transpose() * pair.previous.homogeneous())
              .hnormalized();
      const Eigen::Vector2d parallax = pair.current - infinity;
      const Eigen::Vector2d across = Eigen::Vector2d(-parallax.y(), parallax.x()).normalized();
      const double sign = unit(rng) < 0.5 ? -1.0 : 1.0;
      const double size = 10.0 + 30.0 * unit(rng);
      pair.current += sign * size / kFocalPx * across;
    }
    scene.pairs.push_back(pair);
    scene.is_false.push_back(is_false);
  }
  return scene;
}

Vector6 moderate_twist(std::mt19937& rng) {
  Vector6 xi;
  const Eigen::Vector3d rotation = random_vector<3>(rng).normalized();
  const Eigen::Vector3d translation = random_vector<3>(rng).normalized();
  xi << 0.03 * rotation, 0.08 * translation;
  return xi;
}

TEST_CASE("Two-point RANSAC finds exactly the false matches") {
  const auto seed = GENERATE(range(1U, 11U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const Scene scene = random_scene(rng, moderate_twist(rng), 80, 0.3);
  const auto pairs = scene.mono();
  const TwoPointResult result =
      two_point_ransac(pairs, scene.T_previous_current.linear(), kThreshold, rng);
  int wrong = 0;
  int inliers = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    wrong += result.inlier[i] == scene.is_false[i] ? 1 : 0;
    inliers += result.inlier[i] ? 1 : 0;
  }
  // A false pair may lie within 2 px of a slightly turned line; a true one at 0.3 px rarely is out.
  CHECK(wrong <= 4);
  CHECK(inliers == result.inliers);
  const double cosine =
      std::abs(result.direction.dot(scene.T_previous_current.translation().normalized()));
  CHECK(cosine > std::cos(0.2));
}

TEST_CASE("The stereo motion is found among false matches with a biased gyroscope") {
  const auto seed = GENERATE(range(1U, 11U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const Scene scene = random_scene(rng, moderate_twist(rng), 60, 0.35);
  // 0.08 rad/s of bias over 50 ms: 1.8 px. No translation is given.
  const Eigen::Vector3d bias = 0.004 * random_vector<3>(rng).normalized();
  const SE3 guess =
      make_pose(scene.T_previous_current.linear() * so3_exp(bias), Eigen::Vector3d::Zero());
  const auto T = estimate_motion(scene.pairs, guess, 1.0 / kFocalPx, rng);
  REQUIRE(T);
  for (std::size_t i = 0; i < scene.pairs.size(); ++i) {
    CHECK((reprojection_distance(scene.pairs[i], *T) > 2.5 / kFocalPx) == scene.is_false[i]);
  }
  // 0.3 px of noise on 40 landmarks: 1e-4 rad; at 3 m in the mean, some tenths of a millimetre.
  const Vector6 error = se3_log(T->inverse() * scene.T_previous_current);
  CHECK(error.head<3>().norm() < 1e-3);
  CHECK(error.tail<3>().norm() < 4e-3);
}

}  // namespace
}  // namespace km
