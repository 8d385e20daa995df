#include "test/support/test.hpp"
#include "modules/outlier_rejection/chi_squared.hpp"
#include "modules/outlier_rejection/cycle_test.hpp"
#include "test/modules/outlier_rejection/chain.hpp"

namespace km {
namespace {

TEST_CASE("Chi-squared with 6 degrees of freedom has its tabulated quantiles") {
  CHECK(chi_squared_6_quantile(0.95) == Approx(12.5916).epsilon(1e-5));
  CHECK(chi_squared_6_quantile(0.99) == Approx(16.8119).epsilon(1e-5));
  CHECK(chi_squared_6(chi_squared_6_quantile(0.3)) == Approx(0.3));
}

TEST_CASE("The distance of true cycles is chi-squared") {
  // Small noise: covariances are first order. 4000 samples: the standard error of the share below
  // a quantile q is sqrt(q (1 - q) / 4000) < 0.0080; four of them are allowed.
  std::mt19937 rng(7);
  const CycleTest test(PcmConfig{});
  constexpr int kSamples = 4000;
  int below_median = 0, below_95 = 0;
  for (int n = 0; n < kSamples; ++n) {
    const TwoRobots robots(0, 1, 6, 0.003, rng);
    const auto i = test.orient(robots.measure(1, 4, 0.005, rng));
    const auto k = test.orient(robots.measure(5, 2, 0.005, rng));
    const double d2 = distance_squared(cycle_through(i, k));
    below_median += d2 <= chi_squared_6_quantile(0.5) ? 1 : 0;
    below_95 += d2 <= chi_squared_6_quantile(0.95) ? 1 : 0;
  }
  CHECK(below_median / double{kSamples} == Approx(0.5).margin(4 * 0.0080));
  CHECK(below_95 / double{kSamples} == Approx(0.95).margin(4 * 0.0035));
}

TEST_CASE("Consistency depends neither on direction, order nor odometry frames") {
  const unsigned seed = GENERATE(range(0U, 20U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const TwoRobots robots(4, 9, 8, 0.05, rng);
  PcmConfig config;
  config.confidence = 0.5;  // about half of the pairs pass
  const CycleTest test(config);
  Closure i = robots.measure(2, 6, 0.1, rng), k = robots.measure(7, 1, 0.1, rng);
  const auto prepared = [&](const Closure& c) { return PreparedClosure(test.orient(c)); };
  const bool expected = test.consistent(prepared(i), prepared(k));
  CHECK(test.consistent(prepared(k), prepared(i)) == expected);
  CHECK(test.consistent(prepared(reversed(i)), prepared(k)) == expected);
  CHECK(test.consistent(prepared(reversed(k)), prepared(reversed(i))) == expected);
  const SE3 T_other_a = random_pose(rng), T_other_b = random_pose(rng);
  for (Closure* c : {&i, &k}) {
    c->from.T_odom_kf = T_other_a * c->from.T_odom_kf;
    c->to.T_odom_kf = T_other_b * c->to.T_odom_kf;
  }
  CHECK(test.consistent(prepared(i), prepared(k)) == expected);
}

TEST_CASE("Noise scales widen the test as covariances would") {
  std::mt19937 rng(3);
  const TwoRobots robots(0, 1, 8, 0.05, rng);
  const Closure i = robots.measure(2, 6, 0.1, rng), k = robots.measure(7, 1, 0.1, rng);
  const auto distance = [&](double odometry, double measured) {
    PcmConfig config{.odometry_noise_scale = odometry, .closure_noise_scale = measured};
    const CycleTest test(config);
    return distance_squared(cycle_through(test.orient(i), test.orient(k)));
  };
  CHECK(distance(3.0, 3.0) == Approx(distance(1.0, 1.0) / 9.0).epsilon(1e-6));
  CHECK(distance(3.0, 1.0) < distance(1.0, 1.0));
  CHECK(distance(3.0, 1.0) > distance(3.0, 3.0));
}

Matrix6 random_covariance(std::mt19937& rng) {
  Matrix6 root;
  for (double& x : root.reshaped()) x = std::normal_distribution<double>()(rng);
  return root * root.transpose();
}

struct Pair {
  Closure i, k;
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

TEST_CASE("The distance of a pair is that of its cycle, link by link") {
  const unsigned seed = GENERATE(range(0U, 200U));
  const bool wrong = GENERATE(false, true);
  CAPTURE(seed, wrong);
  std::mt19937 rng(seed);
  const Pair pair = random_pair(rng, CycleTest(PcmConfig{}), wrong);
  const double expected = distance_squared(cycle_through(pair.i, pair.k));
  const PreparedClosure i(pair.i), k(pair.k);
  // Both work in double precision on covariances whose condition is below 1e6.
  CHECK(closes_within(i, k, expected * (1.0 + 1e-7)));
  CHECK_FALSE(closes_within(i, k, expected * (1.0 - 1e-7)));
}

TEST_CASE("Exact pairs without any covariance are consistent, wrong ones are not") {
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

TEST_CASE("Odometry that grows more certain along the way makes no pair consistent") {
  std::mt19937 rng(4);
  const TwoRobots robots(0, 1, 10, 0.01, rng);
  Closure i = robots.measure(3, 5, 0.1, rng), k = robots.measure(7, 2, 0.1, rng);
  i.from.covariance = 100.0 * Matrix6::Identity();  // covariance of keyframe 3; keyframe 7 has far
                                                    // less
  const CycleTest test(PcmConfig{});
  CHECK_FALSE(test.consistent(PreparedClosure(test.orient(i)), PreparedClosure(test.orient(k))));
}

}  // namespace
}  // namespace km
