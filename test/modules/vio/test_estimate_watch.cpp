#include <catch2/catch.hpp>
#include <random>

#include "modules/vio/estimate_watch.hpp"

namespace km {
namespace {

// An image of `points` points, each of which contradicts a right estimate with probability `rate`.
ImageFit random_fit(std::mt19937& rng, int points, double rate) {
  ImageFit fit{.points = points};
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
}

TEST_CASE("A wrong estimate is contradicted within half a second of images",
          "[vio][contradiction]") {
  EstimateWatch watch;
  for (int k = 0; k < 1000; ++k) watch.add({.points = 60, .contradicting = 2});
  int images = 0;
  for (; !watch.is_contradicted(); ++images) watch.add({.points = 60, .contradicting = 45});
  CHECK(images <= 10);  // at 20 Hz
}

}  // namespace
}  // namespace km
