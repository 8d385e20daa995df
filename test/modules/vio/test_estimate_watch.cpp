#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "modules/vio/estimate_watch.hpp"

namespace km {
namespace {

constexpr double kMedianSquare = 2.0 * std::numbers::ln2;  // chi-squared, 2 degrees of freedom

// An image of `points` points, each of which contradicts a right estimate with probability `rate`.
ImageFit random_fit(std::mt19937& rng, int points, double rate) {
  ImageFit fit{.points = points, .median_square = kMedianSquare};
  for (int k = 0; k < points; ++k) fit.contradicting += std::bernoulli_distribution(rate)(rng);
  return fit;
}

TEST_CASE("A right estimate is not contradicted by the points that trackers lose",
          "[vio][contradiction]") {
  const int points = GENERATE(8, 40, 300);
  std::mt19937 rng(7);
  EstimateWatch watch;
  for (int k = 0; k < 200'000; ++k) {
    watch.add(random_fit(rng, points, 0.05));
    REQUIRE_FALSE(watch.is_contradicted());
  }
  CHECK(watch.variance_factor() == Approx(1.0));
}

TEST_CASE("A wrong estimate is contradicted within half a second of images",
          "[vio][contradiction]") {
  EstimateWatch watch;
  for (int k = 0; k < 1000; ++k) watch.add({.points = 60, .contradicting = 2});
  int images = 0;
  for (; !watch.is_contradicted(); ++images) watch.add({.points = 60, .contradicting = 45});
  CHECK(images <= 10);  // at 20 Hz
}

// Errors of points with three times the assumed standard deviation.
TEST_CASE("The variance factor is the squared ratio of errors to their assumed deviation",
          "[vio][contradiction]") {
  std::mt19937 rng(3);
  constexpr double kRatio = 3.0;
  EstimateWatch watch;
  for (int k = 0; k < 2000; ++k) {
    std::vector<double> squares;
    for (int i = 0; i < 101; ++i) {
      std::normal_distribution<double> error(0.0, kRatio);
      const double x = error(rng), y = error(rng);
      squares.push_back(x * x + y * y);
    }
    std::ranges::nth_element(squares, squares.begin() + 50);
    watch.add({.points = 101, .median_square = squares[50]});
  }
  CHECK(watch.variance_factor() == Approx(kRatio * kRatio).epsilon(0.03));
  watch.start_keyframe();
  watch.add({.points = 101, .median_square = 0.2});
  CHECK(watch.variance_factor() == Approx(0.2 / kMedianSquare));
  watch.add({.points = EstimateWatch::kMinPoints - 1});
  CHECK(watch.variance_factor() == 1.0);
}

}  // namespace
}  // namespace km
