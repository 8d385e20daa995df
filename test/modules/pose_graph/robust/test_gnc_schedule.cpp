#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "modules/pose_graph/robust/gnc_schedule.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

// A schedule for candidates inside one robot.
GncSchedule inside(std::size_t candidates, const GncOptions& options) {
  return {std::vector<GncCandidate>(candidates), 1, {}, options, 3};
}

double surrogate(double w, double r2, double c2, double mu) {
  return w * r2 + mu * (1.0 - w) / (mu + w) * c2;
}

TEST_CASE("the GNC weight minimises the surrogate of the truncated cost", "[gnc]") {
  const double c2 = 9.0;
  const double mu = GENERATE(1e-3, 0.1, 1.0, 30.0);
  const double r2 = GENERATE(0.1, 4.0, 8.9, 9.1, 20.0, 500.0, 2e4);
  CAPTURE(mu, r2);
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k <= 100000; ++k) least = std::min(least, surrogate(1e-5 * k, r2, c2, mu));
  const double w = gnc_weight(r2, c2, mu);
  CHECK(w >= 0.0);
  CHECK(w <= 1.0);
  CHECK(surrogate(w, r2, c2, mu) <= least + 1e-12 * (r2 + c2));  // the grid contains no better one
}

TEST_CASE("the first mu makes the surrogate convex at the largest residual", "[gnc]") {
  CHECK(gnc_first_mu(50.0, 20.0) == Approx(0.25));
  CHECK(gnc_weight(50.0, 20.0, 0.25) > 0.0);  // nobody is out from the start
  CHECK(std::isinf(gnc_first_mu(10.0, 20.0)));
  CHECK(gnc_weight(10.0, 20.0, gnc_first_mu(10.0, 20.0)) == 1.0);
}

TEST_CASE("the default threshold is a chi-squared quantile", "[gnc]") {
  CHECK(default_barc(3) == Approx(std::sqrt(16.8119)).epsilon(1e-5));  // tables: 99 %, 6 and 3
  CHECK(default_barc(2) == Approx(std::sqrt(11.3449)).epsilon(1e-5));
}

TEST_CASE("the GNC schedule ends, with every candidate decided by its residual", "[gnc]") {
  GncSchedule schedule = inside(4, {.barc = 3.0});
  const std::vector<float> residuals{0.5F, 2.9F, 3.1F, 400.0F};
  int updates = 0;
  double mu = 0.0;
  while (schedule.update(residuals)) {
    CHECK(schedule.mu() > mu);
    mu = schedule.mu();
    REQUIRE(++updates < 60);
  }
  CHECK(schedule.decided());
  CHECK(schedule.updates() == updates);
  CHECK(schedule.kept(0));
  CHECK(schedule.kept(1));
  CHECK(!schedule.kept(2));
  CHECK(!schedule.kept(3));
  CHECK(schedule.weight(3) == 0.0);
}

TEST_CASE("GNC decides at once when all residuals are small", "[gnc]") {
  GncSchedule schedule = inside(3, {.barc = 3.0});
  CHECK(schedule.update(std::vector<float>{0.1F, 1.0F, 2.0F}));
  CHECK(schedule.decided());
  CHECK(!schedule.update(std::vector<float>{0.1F, 1.0F, 2.0F}));
}

TEST_CASE("GNC without candidates has nothing to decide", "[gnc]") {
  GncSchedule schedule = inside(0, {});
  CHECK(schedule.update({}));
  CHECK(schedule.decided());
}

TEST_CASE("a rejected step of odometry keeps its robot in one piece", "[gnc]") {
  GncSchedule schedule({{0, 0, true}, {0, 0, false}}, 1, {}, {.barc = 3.0}, 3);
  while (schedule.update(std::vector<float>{50.0F, 50.0F})) {
  }
  CHECK(!schedule.kept(0));
  CHECK(schedule.weight(0) == kJointWeight);
  CHECK(schedule.weight(1) == 0.0);
}

TEST_CASE("robots that lose all their closures keep the best one as a rejected bridge", "[gnc]") {
  GncSchedule schedule({{0, 1}, {0, 1}, {1, 2}, {0, 1}}, 3, {}, {.barc = 3.0}, 3);
  std::vector<float> residuals{80.0F, 60.0F, 1.0F, 70.0F};
  while (schedule.update(residuals)) {
    for (std::size_t k = 0; k < 4; ++k)  // a bridge fits once the poses are solved for
      residuals[k] = schedule.weight(k) == 1.0 ? 0.0F : residuals[k];
  }
  CHECK(schedule.weight(1) == 1.0);
  CHECK(!schedule.kept(1));
  CHECK(schedule.kept(2));
  CHECK(schedule.weight(0) == 0.0);
  CHECK(schedule.weight(3) == 0.0);
}

TEST_CASE("GNC refuses what cannot be", "[gnc]") {
  CHECK_THROWS_AS(inside(1, {.barc = -1.0}), std::invalid_argument);
  CHECK_THROWS_AS(inside(1, {.mu_step = 1.0}), std::invalid_argument);
  CHECK_THROWS_AS(inside(1, {.max_updates = 0}), std::invalid_argument);
  CHECK_THROWS_AS(GncSchedule({{0, 2}}, 2, {}, {}, 3), std::invalid_argument);
  GncSchedule schedule = inside(1, {});
  CHECK_THROWS_AS(schedule.update(std::vector<float>(2, 1.0F)), std::invalid_argument);
  CHECK_THROWS_AS(schedule.update(std::vector<float>{std::nanf("")}), std::invalid_argument);
}

}  // namespace
}  // namespace km
