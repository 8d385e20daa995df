#include "modules/core/geometry/lie.hpp"
#include "modules/robust/odometry_noise.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// One robot on a helix that passes over itself every 50 keyframes. The claimed noise of a step and
// of a closure is 0.01 rad and 5 cm.
struct Walk {
  static constexpr std::uint32_t kKeyframes = 300, kTurn = 50;
  static constexpr double kRotation = 0.01, kTranslation = 0.05;

  std::mt19937 rng;
  int dimension;
  std::vector<SE3> truth;
  std::vector<PoseEdge> steps, closures;

  explicit Walk(unsigned seed, int in_dimension = 3) : rng(seed), dimension(in_dimension) {
    for (std::uint32_t k = 0; k < kKeyframes; ++k) {
      const double angle = 2.0 * 3.14159265358979 * k / kTurn;
      truth.push_back(
          make_pose(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
                    Eigen::Vector3d(8.0 * std::cos(angle), 8.0 * std::sin(angle),
                                    dimension == 2 ? 0.0 : 0.02 * k)));
    }
  }

  PoseEdge edge(std::uint32_t i, std::uint32_t j, double rotation, double translation) {
    Vector6 xi = random_vector<6>(rng);
    xi.head<3>() *= rotation * kRotation;
    xi.tail<3>() *= translation * kTranslation;
    if (dimension == 2) xi(0) = xi(1) = xi(5) = 0.0;
    const Precision claimed{(dimension == 2 ? 1.0 : 0.5) / (kRotation * kRotation),
                            1.0 / (kTranslation * kTranslation)};
    return {{0, i}, {0, j}, truth[i].inverse() * truth[j] * se3_exp(xi), claimed};
  }
  void walk(double rotation, double translation) {
    for (std::uint32_t k = 1; k < kKeyframes; ++k)
      steps.push_back(edge(k - 1, k, rotation, translation));
  }
  // Two closures of successive keyframes at every `stride`-th keyframe.
  void close_in_twos(std::uint32_t stride, double rotation) {
    for (std::uint32_t k = 0; k + 51 < kKeyframes; k += stride)
      for (const std::uint32_t turn : {50U, 51U})
        closures.push_back(edge(k, k + turn, rotation, 1.0));
  }
  void close(std::uint32_t every, double noise = 1.0) {
    for (std::uint32_t k = 0; k + kTurn < kKeyframes; k += every) {
      closures.push_back(edge(k, k + kTurn, noise, noise));
      if (closures.size() % 2 == 0) {  // measured from the other end
        PoseEdge& e = closures.back();
        std::swap(e.from, e.to);
        e.T_from_to = e.T_from_to.inverse();
      }
    }
  }
  void add_false(std::size_t count) {
    std::uniform_int_distribution<std::uint32_t> any(0, kKeyframes - 1);
    for (std::size_t k = 0; k < count; ++k) {
      PoseEdge e = closures.front();
      e.from.index = any(rng);
      e.to.index = (e.from.index + 20 + any(rng) % 200) % kKeyframes;
      e.T_from_to = random_pose(rng, 20.0);
      closures.push_back(e);
    }
  }
  [[nodiscard]] OdometryNoise noise() const {
    return estimate_odometry_noise(steps, closures, dimension);
  }
};

// Ratio of the larger to the smaller number.
double factor(double a, double b) {
  return std::max(a / b, b / a);
}

}  // namespace

TEST_CASE("A closure that is too far for any density is no noise of odometry") {
  Walk walk(1);
  walk.walk(1.0, 1.0);
  walk.close(2);
  walk.closures.push_back(walk.closures.front());
  walk.closures.back().T_from_to.translation().setConstant(1e200);  // its density is not a number
  const OdometryNoise noise = walk.noise();
  CHECK(noise.rotation == 1.0);
  CHECK(noise.translation == 1.0);
  CHECK(noise.likely.empty());
}

TEST_CASE("The noise of odometry is estimated from cycles") {
  const unsigned seed = GENERATE(range(1U, 11U));
  const double scale = GENERATE(1.0, 2.0, 7.0, 20.0);
  const int dimension = GENERATE(2, 3);
  CAPTURE(seed, scale, dimension);
  Walk walk(seed, dimension);
  walk.walk(scale, scale);
  walk.close(2);
  const OdometryNoise noise = walk.noise();
  // Five chains of the walk, with three components each, share no step. The standard deviation of
  // the log of a scale is therefore 1 / sqrt(2 * 15) = 0.18, and three of these are a factor of
  // 1.7. Rotation noise times lever arms is as large as translation noise, so the estimate of
  // translation noise is worse. In the plane, rotation has one component, and the factor is 2.6.
  CHECK(noise.places >= 20);
  CHECK(factor(noise.rotation, scale) < (dimension == 2 ? 2.6 : 1.7));
  CHECK(factor(noise.translation, scale) < (dimension == 2 ? 2.6 : 2.2));
}

// A turn of 50 steps then has a rotation noise of 2.8 rad, which a cycle of one closure cannot
// show.
TEST_CASE("Rotation noise beyond what a turn shows is estimated from closures near each other") {
  const unsigned seed = GENERATE(range(1U, 6U));
  constexpr double kScale = 40.0;
  Walk walk(seed);
  walk.walk(kScale, kScale);
  walk.close(1);
  walk.add_false(walk.closures.size() / 4);
  const OdometryNoise noise = walk.noise();
  CAPTURE(seed, noise.rotation, noise.translation);
  CHECK(factor(noise.rotation, kScale) < 1.7);
  CHECK(factor(noise.translation, kScale) < 2.2);
}

TEST_CASE("Noise of rotation and of translation are distinguished") {
  const unsigned seed = GENERATE(range(1U, 6U));
  Walk walk(seed);
  walk.walk(1.0, 10.0);
  walk.close(2);
  const OdometryNoise noise = walk.noise();
  CHECK(noise.rotation < 1.5);
  CHECK(factor(noise.translation, 10.0) < 1.7);
}

TEST_CASE("False closures neither increase the estimated noise of odometry nor hide it") {
  const unsigned seed = GENERATE(range(1U, 6U));
  const double scale = GENERATE(1.0, 7.0);
  CAPTURE(seed, scale);
  Walk walk(seed);
  walk.walk(scale, scale);
  walk.close(2);
  walk.add_false(walk.closures.size() / 2);
  const OdometryNoise noise = walk.noise();
  // At 7 times the noise, the error at the ends of long chains is as large as that of false
  // closures.
  CHECK(factor(noise.rotation, scale) < (scale > 1.0 ? 2.0 : 1.7));
  CHECK(factor(noise.translation, scale) < (scale > 1.0 ? 3.0 : 2.2));
}

TEST_CASE("Random closures that end near each other are no noise of odometry") {
  const int dimension = GENERATE(2, 3);
  CAPTURE(dimension);
  int noisy = 0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    Walk walk(seed, dimension);
    walk.walk(1.0, 1.0);
    walk.close(50);
    walk.add_false(40);
    const OdometryNoise noise = walk.noise();
    noisy += noise.rotation > 1.0 || noise.translation > 1.0 ? 1 : 0;
  }
  CHECK(noisy <= 1);  // odds of 10 to 1 suffice, so a few walks seem noisy by chance
}

TEST_CASE("A wrong place counts once, however many closures it has") {
  Walk walk(1);
  walk.walk(1.0, 1.0);
  walk.close(10);
  SE3 lie = random_pose(walk.rng, 5.0);
  for (std::uint32_t k = 0; k < 10; ++k) {
    PoseEdge e = walk.edge(20 + k, 240 + k, 1.0, 1.0);
    e.T_from_to = walk.truth[20 + k].inverse() * lie * walk.truth[240 + k];
    walk.closures.push_back(e);
  }
  const OdometryNoise noise = walk.noise();
  CHECK(noise.rotation < 2.0);
  CHECK(noise.translation < 2.0);
}

// Noise of odometry alone is no reason to weaken closures.
TEST_CASE("Closures as precise as they claim do not have the noise of odometry") {
  const unsigned seed = GENERATE(range(1U, 6U));
  CAPTURE(seed);
  Walk walk(seed);
  walk.walk(11.0, 1.0);
  walk.close_in_twos(4, 1.0);
  const OdometryNoise noise = walk.noise();
  CHECK_FALSE(noise.of_closures);
  CHECK(factor(noise.rotation, 11.0) < 1.7);
}

// Only cycles of successive closures are short enough. They do not distinguish noisy steps from
// noisy closures, except by translations that are more precise than claimed.
TEST_CASE("Closures have the noise of odometry, although their translations are precise") {
  const unsigned seed = GENERATE(range(1U, 6U));
  CAPTURE(seed);
  Walk walk(seed);
  walk.walk(15.0, 1.0);
  walk.close_in_twos(1, 15.0);
  for (auto* edges : {&walk.steps, &walk.closures})
    for (PoseEdge& e : *edges) e.precision.tau /= 100.0;
  const OdometryNoise noise = walk.noise();
  CHECK(noise.of_closures);
  CHECK(factor(noise.rotation, 15.0) < 1.7);
  CHECK(noise.translation == 1.0);
}

TEST_CASE("Closures that are noisier than they claim do not count as noise of odometry") {
  const unsigned seed = GENERATE(range(1U, 6U));
  Walk walk(seed);
  walk.walk(1.0, 1.0);
  walk.close(2, 5.0);
  for (std::uint32_t k = 0; k + 3 < Walk::kKeyframes;
       k += 10)  // short cycles: noise of closures only
    walk.closures.push_back(walk.edge(k, k + 3, 5.0, 5.0));
  const OdometryNoise noise = walk.noise();
  CHECK(noise.rotation < 2.0);
  CHECK(noise.translation < 2.0);
}

TEST_CASE("Closures that are much noisier than odometry, as shares of their claims, weigh less") {
  const unsigned seed = GENERATE(range(1U, 11U));
  const int dimension = GENERATE(2, 3);
  CAPTURE(seed, dimension);
  const auto beside = [&](double odometry, double closures, std::size_t are_false) {
    Walk walk(seed, dimension);
    walk.walk(odometry, odometry);
    walk.close(2, closures);
    walk.add_false(are_false);
    return walk.noise().beside;
  };
  CHECK(beside(1.0, 1.0, 0) == 1.0);
  CHECK(beside(0.005, 0.005, 0) == 1.0);
  CHECK(beside(0.01, 1.0, 0) >= 16.0);
  CHECK(beside(0.01, 1.0, 8) >= 16.0);
  CHECK(beside(1.0, 1.0, 1000) == 1.0);  // false closures are no noise
}

// Two or three cycles show either noise equally well.
TEST_CASE("Noise of odometry is not read as that of few closures") {
  const unsigned seed = GENERATE(range(1U, 31U));
  CAPTURE(seed);
  Walk walk(seed);
  walk.walk(3.0, 3.0);
  walk.close(100);
  CHECK(walk.noise().beside == 1.0);
}

TEST_CASE("Without closures, or with a single one, the noise of odometry is the claimed one") {
  Walk walk(1);
  walk.walk(1.0, 1.0);
  CHECK(walk.noise().rotation == 1.0);
  CHECK(walk.noise().places == 0);
  walk.closures.push_back(walk.edge(3, 200, 1.0, 1.0));
  CHECK(walk.noise().rotation < 1.5);
  CHECK(walk.noise().translation < 1.5);
  CHECK(walk.noise().places == 1);
  walk.closures.front().to.index = 5000;  // no such keyframe
  CHECK(walk.noise().places == 0);
}

}  // namespace km
