#include <catch2/catch.hpp>

#include <cmath>
#include <complex>
#include <numbers>

#include "modules/simulation/motion/road_profile.hpp"

namespace km {
namespace {

// One-sided spectral density of the heights near `frequency` [cycles/m], averaged over windows.
double density_at(double frequency, double roughness) {
  constexpr double kWindow_m = 100.0, kStep_m = 0.05;
  constexpr int kWindows = 60;
  const RoadProfile profile(0.0, kWindows * kWindow_m, roughness, 3);
  double sum = 0.0;
  for (int w = 0; w < kWindows; ++w) {
    std::complex<double> transform = 0.0;
    for (double x = 0.0; x < kWindow_m; x += kStep_m) {
      // Hann's window; its mean square is 3/8.
      const double weight = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * x / kWindow_m);
      transform += weight * profile.height_m(w * kWindow_m + x) * kStep_m *
                   std::polar(1.0, -2.0 * std::numbers::pi * frequency * x);
    }
    sum += 2.0 * std::norm(transform) / (0.375 * kWindow_m);
  }
  return sum / kWindows;
}

TEST_CASE("A road of roughness 1 has the spectrum of ISO 8608 class A", "[motion]") {
  // 60 windows of an exponentially distributed estimate: 13 % standard deviation, checked to 4.
  for (const double frequency : {0.1, 0.2, 0.5, 1.0}) {
    CAPTURE(frequency);
    const double expected = 16e-6 * std::pow(frequency / 0.1, -2.0);
    CHECK(density_at(frequency, 1.0) == Approx(expected).epsilon(0.5));
  }
}

TEST_CASE("Roughness scales heights, and none is flat", "[motion]") {
  const RoadProfile one(0.0, 50.0, 1.0, 8), three(0.0, 50.0, 3.0, 8), none(0.0, 50.0, 0.0, 8);
  for (double x = 0.0; x < 50.0; x += 0.3) {
    CHECK(three.height_m(x) == Approx(3.0 * one.height_m(x)).margin(1e-12));
    CHECK(none.height_m(x) == 0.0);
    CHECK(std::abs(one.height_m(x)) < 0.05);
  }
}

}  // namespace
}  // namespace km
