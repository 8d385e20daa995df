#include <catch2/catch.hpp>

#include "modules/outlier_rejection/cycle_test.hpp"
#include "modules/outlier_rejection/pair_cycle.hpp"
#include "test/modules/outlier_rejection/chain.hpp"

namespace km {
namespace {

Matrix6 random_covariance(std::mt19937& rng) {
  Matrix6 root;
  for (double& x : root.reshaped()) x = std::normal_distribution<double>()(rng);
  return root * root.transpose();
}

TEST_CASE("A covariance by blocks moves as with the adjoint", "[pcm]") {
  const unsigned seed = GENERATE(range(0U, 10U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const Matrix6 Sigma = random_covariance(rng);
  const SE3 T = random_pose(rng, 5.0);
  const Matrix6 expected = adjoint(T) * Sigma * adjoint(T).transpose();
  const Matrix6 moved = transported(T, BlockCovariance(Sigma)).matrix();
  CHECK((moved - expected).norm() <= 1e-12 * expected.norm());
}

struct Pair {
  OrientedClosure i, k;
};

// Two closures with noise on two long chains, so that every covariance matters; some wrong.
Pair random_pair(std::mt19937& rng, const CycleTest& test, bool wrong) {
  const TwoRobots robots(2, 5, 40, 0.03, rng);
  std::uniform_int_distribution<std::size_t> keyframe(0, 39);
  const auto measured = [&] {
    const std::size_t a = keyframe(rng);
    const std::size_t b = keyframe(rng);
    Closure c = robots.measure(a, b, 0.1, rng);
    c.covariance = 0.01 * random_covariance(rng);
    return c;
  };
  const Closure i = measured();
  Closure k = measured();
  if (wrong) k.T_from_to = k.T_from_to * se3_exp(Vector6(0.5 * random_vector<6>(rng)));
  return {test.orient(i), test.orient(k)};
}

TEST_CASE("The distance of a pair is that of its cycle, link by link", "[pcm]") {
  const unsigned seed = GENERATE(range(0U, 200U));
  const bool wrong = GENERATE(false, true);
  CAPTURE(seed, wrong);
  std::mt19937 rng(seed);
  const Pair pair = random_pair(rng, CycleTest(PcmConfig{}), wrong);
  const double expected = distance_squared(cycle_through(pair.i, pair.k).T);
  const PreparedClosure i(pair.i), k(pair.k);
  const PairCycle cycle(i, k);
  // Both work in double precision on covariances whose condition is below 1e6.
  CHECK(cycle.within_distance(expected * (1.0 + 1e-7)));
  CHECK_FALSE(cycle.within_distance(expected * (1.0 - 1e-7)));
}

TEST_CASE("The lengths of a pair are those of its cycle, link by link", "[pcm]") {
  const unsigned seed = GENERATE(range(0U, 20U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const Pair pair = random_pair(rng, CycleTest(PcmConfig{}), true);
  const Cycle expected = cycle_through(pair.i, pair.k);
  const PreparedClosure i(pair.i), k(pair.k);
  const PairCycle cycle(i, k);
  CHECK(cycle.translation_m() == Approx(expected.T.T.translation().norm()).epsilon(1e-9));
  CHECK(cycle.rotation_rad() == Approx(angle_of(expected.T.T.linear())).epsilon(1e-9));
  CHECK(cycle.transforms() == expected.transforms);
}

TEST_CASE("Exact pairs without any covariance are consistent, wrong ones are not", "[pcm]") {
  std::mt19937 rng(4);
  const TwoRobots robots(0, 1, 10, 0.0, rng);
  const CycleTest test(PcmConfig{});
  const auto prepared = [&](const Closure& c) { return PreparedClosure(test.orient(c)); };
  const Closure i = robots.measure(3, 5, 0.0, rng);
  Closure k = robots.measure(7, 2, 0.0, rng);
  CHECK(test.consistent(prepared(i), prepared(k)));
  k.T_from_to.translation().x() += 1e-3;
  CHECK_FALSE(test.consistent(prepared(i), prepared(k)));
}

TEST_CASE("Odometry that grows more certain along the way makes no pair consistent", "[pcm]") {
  std::mt19937 rng(4);
  const TwoRobots robots(0, 1, 10, 0.01, rng);
  Closure i = robots.measure(3, 5, 0.1, rng), k = robots.measure(7, 2, 0.1, rng);
  i.from.covariance = 100.0 * Matrix6::Identity();  // of keyframe 3; keyframe 7 has far less
  const CycleTest test(PcmConfig{});
  CHECK_FALSE(test.consistent(PreparedClosure(test.orient(i)), PreparedClosure(test.orient(k))));
}

}  // namespace
}  // namespace km
