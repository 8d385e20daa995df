#include <catch2/catch.hpp>
#include <random>

#include "modules/sensors/missing_images.hpp"

namespace km {
namespace {

constexpr Stamp kInterval = 50'000'000;

TEST_CASE("Missing images are counted at any jitter", "[sensors]") {
  const unsigned seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::uniform_int_distribution<Stamp> jitter(-kInterval / 10, kInterval / 10);
  std::bernoulli_distribution is_lost(0.1);
  MissingImages missing;
  std::size_t lost = 0, counted = 0;
  for (int k = 0; k < 1000; ++k) {
    const bool can_be_lost = k > 2 * static_cast<int>(MissingImages::kFewest) && k < 999;
    if (can_be_lost && is_lost(rng))
      ++lost;
    else
      counted += missing.before(k * kInterval + jitter(rng)).missing;
  }
  CHECK(lost > 50);
  CHECK(counted == lost);
}

TEST_CASE("A new stream or a new rate reports missing images only briefly", "[sensors]") {
  MissingImages missing;
  CHECK(missing.before(kInterval).missing == 0);
  CHECK(missing.before(9 * kInterval).missing == 0);  // the interval is not known yet
  Stamp stamp = 9 * kInterval;
  for (int k = 0; k < 50; ++k) CHECK(missing.before(stamp += kInterval).missing == 0);
  CHECK(missing.before(stamp += 40 * kInterval).missing == 39);
  const ImageGap restart = missing.before(stamp += 41 * kInterval);
  CHECK(restart.missing == 0);
  CHECK(restart.pause_s == Approx(2.05));
  std::size_t counted = 0;
  for (int k = 0; k < 100; ++k) counted += missing.before(stamp += 2 * kInterval).missing;
  CHECK(counted <= MissingImages::kIntervals / 2 + 1);
}

}  // namespace
}  // namespace km
