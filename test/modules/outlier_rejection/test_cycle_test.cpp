#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>

#include "modules/outlier_rejection/chi_squared.hpp"
#include "modules/outlier_rejection/cycle_test.hpp"
#include "test/modules/outlier_rejection/chain.hpp"

namespace km {
namespace {

constexpr double kPi = std::numbers::pi;

// Three steps round a unit square: the true closure 3 -> 0 is rotz(90 deg, 1).
Chain square(double variance = 1e-4) {
  Chain chain(0);
  for (int i = 0; i < 3; ++i) chain.step(rotz(kPi / 2, 1.0), variance);
  return chain;
}

bool passes_gate(const PcmConfig& config, const Chain& chain, const SE3& T_3_0) {
  const CycleTest test(config);
  return test.agrees_with_odometry(test.orient(closure(chain.at(3), chain.at(0), T_3_0)));
}

TEST_CASE("The odometry gate bounds translation per transform", "[pcm]") {
  const PcmConfig config = bounds_per_transform(0.051, kPi);
  CHECK(passes_gate(config, square(), rotz(kPi / 2, 1.0)));
  CHECK(passes_gate(config, square(), rotz(kPi / 2, 0.8)));          // 0.200 / 4 = 0.050
  CHECK_FALSE(passes_gate(config, square(), rotz(kPi / 2, 0.792)));  // 0.208 / 4 = 0.052
}

TEST_CASE("The odometry gate bounds rotation per transform", "[pcm]") {
  const PcmConfig config = bounds_per_transform(100.0, 0.005);
  CHECK(passes_gate(config, square(), rotz(1.551, 1.0)));       // 0.0198 / 4 = 0.00495
  CHECK_FALSE(passes_gate(config, square(), rotz(1.55, 1.0)));  // 0.0208 / 4 = 0.0052
}

TEST_CASE("The Mahalanobis gate refuses a closure that claims to be more certain", "[pcm]") {
  const Chain chain = square(0.1);
  const CycleTest test(PcmConfig{});
  const auto distance = [&](double variance) {
    const SE3 T_3_0 = rotz(1.51, 0.8);
    return distance_squared(
        cycle_along_odometry(test.orient(closure(chain.at(3), chain.at(0), T_3_0, variance))).T);
  };
  CHECK(distance(0.1) < distance(0.05));
  CHECK(distance(0.05) < distance(0.01));
}

TEST_CASE("Chi-squared with 6 degrees of freedom has its tabulated quantiles", "[pcm]") {
  CHECK(chi_squared_6_quantile(0.95) == Approx(12.5916).epsilon(1e-5));
  CHECK(chi_squared_6_quantile(0.99) == Approx(16.8119).epsilon(1e-5));
  CHECK(chi_squared_6(chi_squared_6_quantile(0.3)) == Approx(0.3));
}

TEST_CASE("The distance of true cycles is chi-squared", "[pcm]") {
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
    const double d2 = distance_squared(cycle_through(i, k).T);
    below_median += d2 <= chi_squared_6_quantile(0.5) ? 1 : 0;
    below_95 += d2 <= chi_squared_6_quantile(0.95) ? 1 : 0;
  }
  CHECK(below_median / double{kSamples} == Approx(0.5).margin(4 * 0.0080));
  CHECK(below_95 / double{kSamples} == Approx(0.95).margin(4 * 0.0035));
}

TEST_CASE("Consistency depends neither on direction nor on order", "[pcm]") {
  const unsigned seed = GENERATE(range(0U, 20U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const TwoRobots robots(4, 9, 8, 0.05, rng);
  PcmConfig config;
  config.confidence = 0.5;  // about half of the pairs pass
  const CycleTest test(config);
  const Closure i = robots.measure(2, 6, 0.1, rng), k = robots.measure(7, 1, 0.1, rng);
  const auto prepared = [&](const Closure& c) { return PreparedClosure(test.orient(c)); };
  const bool expected = test.consistent(prepared(i), prepared(k));
  CHECK(test.consistent(prepared(k), prepared(i)) == expected);
  CHECK(test.consistent(prepared(reversed(i)), prepared(k)) == expected);
  CHECK(test.consistent(prepared(reversed(k)), prepared(reversed(i))) == expected);
}

TEST_CASE("Consistency does not depend on either robot's odometry frame", "[pcm]") {
  const unsigned seed = GENERATE(range(0U, 10U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const TwoRobots robots(0, 1, 8, 0.05, rng);
  const CycleTest test(PcmConfig{});
  Closure i = robots.measure(2, 6, 0.1, rng), k = robots.measure(7, 1, 0.1, rng);
  const double before = distance_squared(cycle_through(test.orient(i), test.orient(k)).T);
  const SE3 T_other_a = random_pose(rng), T_other_b = random_pose(rng);
  for (Closure* c : {&i, &k}) {
    c->from.T_odom_kf = T_other_a * c->from.T_odom_kf;
    c->to.T_odom_kf = T_other_b * c->to.T_odom_kf;
  }
  const double after = distance_squared(cycle_through(test.orient(i), test.orient(k)).T);
  CHECK(after == Approx(before).epsilon(1e-9));
}

TEST_CASE("Noise scales widen the test as covariances would", "[pcm]") {
  std::mt19937 rng(3);
  const TwoRobots robots(0, 1, 8, 0.05, rng);
  const Closure i = robots.measure(2, 6, 0.1, rng), k = robots.measure(7, 1, 0.1, rng);
  const auto distance = [&](double odometry, double measured) {
    PcmConfig config;
    config.odometry_noise_scale = odometry;
    config.closure_noise_scale = measured;
    const CycleTest test(config);
    return distance_squared(cycle_through(test.orient(i), test.orient(k)).T);
  };
  CHECK(distance(3.0, 3.0) == Approx(distance(1.0, 1.0) / 9.0).epsilon(1e-6));
  CHECK(distance(3.0, 1.0) < distance(1.0, 1.0));
  CHECK(distance(3.0, 1.0) > distance(3.0, 3.0));
}

TEST_CASE("Exact cycles without any covariance are consistent, wrong ones are not", "[pcm]") {
  const Chain chain = square(0.0);
  const CycleTest test(PcmConfig{});
  const auto agrees = [&](double x) {
    return test.agrees_with_odometry(
        test.orient(closure(chain.at(3), chain.at(0), rotz(kPi / 2, x), 0.0)));
  };
  CHECK(agrees(1.0));
  CHECK_FALSE(agrees(1.001));
}

}  // namespace
}  // namespace km
