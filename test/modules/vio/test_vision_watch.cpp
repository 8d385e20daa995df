#include "modules/vio/estimate_watch.hpp"
#include "modules/vio/vision_watch.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr Stamp kStart = 7'000'000'000, kPeriod = 50'000'000;

// The events of images in a row, each with the landmarks that it sees.
struct Watched {
  VisionWatch watch{};
  Stamp stamp = kStart;
  std::vector<VisionEvent> events = {};

  void add(int images, int seen) {
    for (int k = 0; k < images; ++k, stamp += kPeriod)
      if (const auto event = watch.add(stamp, 2 * seen + 1, seen)) events.push_back(*event);
  }
};

TEST_CASE("A loss of vision is reported with its first image and its end") {
  Watched run;
  run.add(20, 50);
  run.add(100, 3);
  REQUIRE(run.events.size() == 1);
  CHECK(run.events[0].is_lost);
  CHECK(run.events[0].since == kStart + 20 * kPeriod);
  CHECK(run.events[0].lasted_s == Approx(VisionWatch::kPatience_s));
  CHECK(run.events[0].features == 7);
  CHECK(run.watch.is_lost());
  CHECK(run.watch.lost_s() == Approx(99 * 0.05));
  run.add(20, 50);
  REQUIRE(run.events.size() == 2);
  CHECK(!run.events[1].is_lost);
  CHECK(run.events[1].lasted_s == Approx(5.0));
  CHECK(!run.watch.is_lost());
  run.add(40, 0);
  CHECK(run.watch.losses() == 2);
  CHECK(run.watch.lost_s() == Approx(5.0 + 39 * 0.05));
}

TEST_CASE("A few images without landmarks and a start without vision are no loss") {
  Watched run;
  run.add(100, 0);
  CHECK(run.events.empty());
  for (int k = 0; k < 20; ++k) {
    run.add(1, VisionWatch::kMinLandmarks);
    run.add(5, VisionWatch::kMinLandmarks - 1);
  }
  CHECK(run.events.empty());
  CHECK(run.watch.lost_s() == 0.0);
}

TEST_CASE("Without an inertial sensor a single image without landmarks is a loss") {
  Watched run{.watch = VisionWatch(0.0)};
  run.add(20, 50);
  run.add(1, VisionWatch::kMinLandmarks - 1);
  REQUIRE(run.events.size() == 1);
  CHECK(run.events[0].is_lost);
  run.add(20, 50);
  REQUIRE(run.events.size() == 2);
  CHECK(run.watch.losses() == 1);
  CHECK(run.watch.lost_s() == Approx(0.05));
}

// An image of `points` points, each of which contradicts a right estimate with probability `rate`.
ImageFit random_fit(std::mt19937& rng, int points, double rate) {
  ImageFit fit{.points = points};
  for (int k = 0; k < points; ++k) fit.contradicting += std::bernoulli_distribution(rate)(rng);
  return fit;
}

TEST_CASE("A right estimate is not contradicted by the points that trackers lose") {
  const int points = GENERATE(8, 40, 300);
  std::mt19937 rng(7);
  EstimateWatch watch;
  for (int k = 0; k < 200'000; ++k) {
    watch.add(random_fit(rng, points, 0.05));
    REQUIRE_FALSE(watch.is_contradicted());
  }
}

TEST_CASE("A wrong estimate is contradicted within half a second of images") {
  EstimateWatch watch;
  for (int k = 0; k < 1000; ++k) watch.add({.points = 60, .contradicting = 2});
  int images = 0;
  for (; !watch.is_contradicted(); ++images) watch.add({.points = 60, .contradicting = 45});
  CHECK(images <= 10);  // at 20 Hz
}

}  // namespace
}  // namespace km
