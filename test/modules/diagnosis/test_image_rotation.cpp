#include <catch2/catch.hpp>

#include <random>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/diagnosis/image_rotation.hpp"

namespace km {
namespace {

constexpr double kSigma = 0.3 / 460.0;  // noise of a bearing

// Points 2 to 8 m away, seen before and after a motion, p_from = R p_to + t, with noise.
std::vector<BearingStep> seen_points(const Eigen::Vector3d& rotation, const Eigen::Vector3d& t,
                                     std::size_t count, std::mt19937& rng) {
  std::uniform_real_distribution<double> across(-0.8, 0.8), up(-0.5, 0.5), depth_m(2.0, 8.0);
  std::normal_distribution<double> noise(0.0, kSigma);
  const Eigen::Matrix3d R = so3_exp(rotation);
  std::vector<BearingStep> steps;
  while (steps.size() < count) {
    const double z = depth_m(rng), x = across(rng), y = up(rng);
    const Eigen::Vector3d from = Eigen::Vector3d(x, y, 1.0) * z;
    const Eigen::Vector3d to = R.transpose() * (from - t);
    const double a = noise(rng), b = noise(rng);
    steps.push_back({from.hnormalized(), to.hnormalized() + Eigen::Vector2d(a, b)});
  }
  return steps;
}

}  // namespace

TEST_CASE("The rotation between two images is found with any translation", "[diagnosis]") {
  std::mt19937 rng(GENERATE(1U, 2U, 3U));
  const Eigen::Vector3d rotation(0.03, -0.05, 0.02);
  const Eigen::Vector3d t = GENERATE(Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(0.1, 0.0, 0.0),
                                     Eigen::Vector3d(0.0, 0.05, 0.15));
  CAPTURE(t.transpose());
  const auto found = rotation_between(seen_points(rotation, t, 150, rng), kSigma);
  REQUIRE(found);
  CHECK(found->inlier_ratio > 0.95);
  // Across the image its error is ten times that of a bearing: see the header.
  CHECK((found->rotation - rotation).norm() < 5.0 * kSigma);
}

TEST_CASE("Points with other motions do not change the rotation between images", "[diagnosis]") {
  std::mt19937 rng(5);
  const Eigen::Vector3d rotation(0.0, 0.04, 0.0), t(0.02, 0.0, 0.1);
  auto steps = seen_points(rotation, t, 150, rng);
  std::uniform_real_distribution<double> off(-0.2, 0.2);
  for (std::size_t k = 0; k < 40; ++k) {
    const double x = off(rng), y = off(rng);
    steps[k].to += Eigen::Vector2d(x, y);
  }
  const auto found = rotation_between(steps, kSigma);
  REQUIRE(found);
  CHECK((found->rotation - rotation).norm() < 5.0 * kSigma);
  CHECK(found->inlier_ratio == Approx(110.0 / 150.0).margin(0.05));
}

TEST_CASE("Too few or random points give no rotation", "[diagnosis]") {
  std::mt19937 rng(6);
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  CHECK_FALSE(rotation_between(seen_points(none, none, 19, rng), kSigma));
  std::uniform_real_distribution<double> anywhere(-0.5, 0.5);
  std::vector<BearingStep> random;
  for (int k = 0; k < 100; ++k) {
    const double a = anywhere(rng), b = anywhere(rng), c = anywhere(rng), d = anywhere(rng);
    random.push_back({{a, b}, {c, d}});
  }
  CHECK_FALSE(rotation_between(random, kSigma));
}

}  // namespace km
