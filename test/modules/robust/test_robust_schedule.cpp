#include "modules/robust/robust_schedule.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

double surrogate(double w, double r2, double c2, double mu) {
  return w * r2 + mu * (1.0 - w) / (mu + w) * c2;
}

// Weighs constant residuals until the schedule has decided.
struct Weighed {
  std::vector<double> residuals;
  double barc;
  RobustSchedule schedule = {};
  std::vector<double> weights = {};
  int updates = 0;

  void run() {
    const double largest = *std::max_element(residuals.begin(), residuals.end());
    weights.assign(residuals.size(), 1.0);
    schedule.start(static_cast<float>(largest), static_cast<std::uint32_t>(residuals.size()), barc);
    while (!schedule.decided()) {
      RobustSchedule::Tally tally;
      for (std::size_t k = 0; k < residuals.size(); ++k) {
        const double w = robust_weight(residuals[k] * residuals[k], barc * barc, schedule.mu());
        if (w != weights[k]) ++tally.changed;
        if (w > 0.0 && w < 1.0) ++tally.fractional;
        weights[k] = w;
      }
      const double mu = schedule.mu();
      schedule.next(tally);
      CHECK((schedule.decided() || schedule.mu() >= mu));
      REQUIRE(++updates <= 100);
    }
  }
};

TEST_CASE("The weight of a closure minimises the surrogate of the truncated cost") {
  const double c2 = 9.0;
  const double mu = GENERATE(1e-6, 1e-3, 0.1, 1.0, 30.0);
  const double r2 = GENERATE(0.0, 0.1, 4.0, 8.9, 9.1, 20.0, 500.0, 2e4);
  CAPTURE(mu, r2);
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k <= 100000; ++k) least = std::min(least, surrogate(1e-5 * k, r2, c2, mu));
  const double w = robust_weight(r2, c2, mu);
  CHECK(w >= 0.0);
  CHECK(w <= 1.0);
  CHECK(surrogate(w, r2, c2, mu) <= least + 1e-12 * (r2 + c2));  // no better one on the grid
}

TEST_CASE("Weights are 0 or 1 once the surrogate is steep") {
  const double mu = GENERATE(100.0, 1e6, 1e30);
  CAPTURE(mu);
  CHECK(robust_weight(std::nan(""), 9.0, mu) == 0.0);
  CHECK(robust_weight(std::nan(""), 9.0, 1e-3) == 0.0);
  CHECK(robust_weight(8.999, 9.0, mu) == 1.0);
  CHECK(robust_weight(9.001, 9.0, mu) == 0.0);
  CHECK(robust_weight(0.0, 9.0, mu) == 1.0);
  CHECK(robust_weight(1e12, 9.0, mu) == 0.0);
}

TEST_CASE(
    "At the first mu the largest residual has a positive weight, and the cost increases up to it") {
  const double c2 = 20.0;
  const double largest = GENERATE(10.1, 19.0, 50.0, 1e3, 1e9);
  CAPTURE(largest);
  const double mu = first_mu(largest, c2);
  CHECK(mu == Approx(c2 / (2.0 * largest - c2)));
  // The cost min_w surrogate has slope 2 w r: it increases up to the largest residual.
  double before = -1.0;
  for (int k = 0; k <= 1000; ++k) {
    const double r2 = largest * std::pow(1e-3 * k, 2);
    const double w = robust_weight(r2, c2, mu);
    CHECK(w > 0.0);
    const double cost = surrogate(w, r2, c2, mu);
    CHECK(cost > before);
    before = cost;
  }
}

TEST_CASE("The default threshold is a chi-squared quantile") {
  // 99.9999 %, 6 and 3 degrees of freedom: closed form with 6, with the error function for 3.
  const double c6 = std::pow(default_threshold(3), 2), c3 = std::pow(default_threshold(2), 2);
  CHECK(std::exp(-c6 / 2.0) * (1.0 + c6 / 2.0 + c6 * c6 / 8.0) == Approx(1e-6).epsilon(1e-6));
  CHECK(std::erfc(std::sqrt(c3 / 2.0)) +
            std::sqrt(2.0 * c3 / 3.14159265358979) * std::exp(-c3 / 2.0) ==
        Approx(1e-6).epsilon(1e-6));
}

TEST_CASE("Decided weights that the poses contradict are reopened a bounded number of times") {
  Weighed weighing{.residuals = {0.5, 400.0}, .barc = 3.0};
  weighing.run();
  REQUIRE(weighing.weights == std::vector<double>{1.0, 0.0});
  weighing.residuals[1] = 2.0;  // after the poses have converged
  REQUIRE(weighing.schedule.reopen());
  RobustSchedule& schedule = weighing.schedule;
  CHECK_FALSE(schedule.decided());
  CHECK(robust_weight(4.0, 9.0, schedule.mu()) == 1.0);
  schedule.next({.changed = 1});
  schedule.next({.changed = 0});
  CHECK(schedule.decided());
  int times = 1;
  while (schedule.reopen()) ++times;
  CHECK(times < 10);
}

TEST_CASE("The schedule ends, and the residual of every closure decides its weight") {
  const double largest = GENERATE(3.001, 30.0, 400.0, 1e4, 1e9);
  CAPTURE(largest);
  Weighed weighing{.residuals = {0.0, 2.999, 3.001, largest}, .barc = 3.0};
  weighing.run();
  CHECK(weighing.weights == std::vector<double>{1.0, 1.0, 0.0, 0.0});
}

TEST_CASE("Weights that never settle are decided nevertheless") {
  RobustSchedule schedule;
  const RobustSchedule::Tally restless =
      GENERATE(RobustSchedule::Tally{.changed = 1}, RobustSchedule::Tally{.fractional = 1},
               RobustSchedule::Tally{1, 1});
  schedule.start(1e6F, 10, 3.0);
  int steps = 0;
  while (!schedule.decided() && steps <= 100) {
    schedule.next(restless);
    ++steps;
  }
  CHECK(schedule.decided());
  RobustSchedule without;  // closures that may be rejected
  without.start(1e3F, 0, 3.0);
  without.next({1, 1});
  CHECK(without.decided());
}

}  // namespace
}  // namespace km
