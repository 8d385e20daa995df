#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "modules/simulation/motion/suspension.hpp"

namespace km {
namespace {

constexpr double kStep_s = 0.01;

TEST_CASE("A body on springs is at rest while nothing changes", "[motion]") {
  const SprungBody ground{1.7, 0.05, -0.03};
  Suspension suspension(ground);
  for (int k = 0; k < 500; ++k) {
    const SprungBody body = suspension.step(ground, 0.0, 0.0, kStep_s);
    CHECK(body.heave_m == ground.heave_m);
    CHECK(body.pitch_rad == ground.pitch_rad);
    CHECK(body.roll_rad == ground.roll_rad);
  }
}

TEST_CASE("After a step of the ground the body swings once over it and settles", "[motion]") {
  Suspension suspension(SprungBody{});
  const SprungBody ground{0.1, 0.0, 0.0};
  double highest = 0.0, last = 0.0;
  for (int k = 0; k < 500; ++k) {
    last = suspension.step(ground, 0.0, 0.0, kStep_s).heave_m;
    highest = std::max(highest, last);
  }
  CHECK(last == Approx(0.1).margin(1e-4));
  CHECK(highest > 0.12);
  CHECK(highest < 0.18);
}

TEST_CASE("Braking lowers the nose, a left turn lifts the left side", "[motion]") {
  Suspension suspension(SprungBody{});
  SprungBody body;
  for (int k = 0; k < 500; ++k) body = suspension.step(SprungBody{}, -1.5, 2.0, kStep_s);
  CHECK(body.pitch_rad == Approx(0.007 * 1.5).epsilon(0.01));  // nose down is positive
  CHECK(body.roll_rad == Approx(0.009 * 2.0).epsilon(0.01));
  CHECK(body.heave_m == 0.0);
}

TEST_CASE("Springs pass slow ground, resound near their own frequency and hide fast ground",
          "[motion]") {
  const auto gain = [](double frequency_hz) {
    Suspension suspension(SprungBody{});
    double highest = 0.0;
    for (int k = 0; k < 3000; ++k) {
      const double t = k * kStep_s;
      const double u = 0.01 * std::sin(2.0 * std::numbers::pi * frequency_hz * t);
      const double x = suspension.step({u, 0.0, 0.0}, 0.0, 0.0, kStep_s).heave_m;
      if (t > 15.0) highest = std::max(highest, std::abs(x));
    }
    return highest / 0.01;
  };
  CHECK(gain(0.1) == Approx(1.0).epsilon(0.02));
  CHECK(gain(1.5) > 1.5);
  CHECK(gain(10.0) < 0.2);
}

}  // namespace
}  // namespace km
