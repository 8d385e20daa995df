#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "apps/lab/simulation/motion/road.hpp"

namespace km {
namespace {

const Route kBlock{{{0, 0}, {80, 0}, {80, 50}, {0, 50}}, 6.0};

// Distance of a point from the closed polyline.
double distance_to(const Route& route, const Eigen::Vector2d& point) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < route.points.size(); ++k) {
    const Eigen::Vector2d& a = route.points[k];
    const Eigen::Vector2d edge = route.points[(k + 1) % route.points.size()] - a;
    const double t = std::clamp((point - a).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
    best = std::min(best, (point - a - t * edge).norm());
  }
  return best;
}

TEST_CASE("A path follows its route and rounds its corners", "[motion]") {
  const double radius = GENERATE(4.0, 6.0, 10.0);
  const RoutePath path(kBlock, radius);
  // Straights less two tangents per corner, plus a quarter circle each; smoothing shortens a
  // little.
  const double expected = 260.0 - 8.0 * radius + 2.0 * std::numbers::pi * radius;
  CHECK(path.length_m() == Approx(expected).margin(1.0));
  double farthest = 0.0, sharpest = 0.0;
  for (double s = 0.0; s < path.length_m(); s += 0.1) {
    farthest = std::max(farthest, distance_to(kBlock, path.at(s).position));
    sharpest = std::max(sharpest, std::abs(path.at(s).curvature));
  }
  // The arc of a right angle passes the corner at (sqrt(2) - 1) r, that is r (1 - 1/sqrt(2)) from
  // the lines.
  CHECK(farthest == Approx(radius * (1.0 - std::sqrt(0.5))).margin(0.15));
  CHECK(sharpest <= 1.05 / radius);  // smoothing tightens short arcs a little
  CHECK(sharpest > 0.9 / radius);
}

TEST_CASE("A path's parameter is the way, its tangent and curvature its derivatives", "[motion]") {
  const RoutePath path(kBlock, 5.0);
  constexpr double kStep_m = 1e-3;
  for (double s = 0.5; s < path.length_m(); s += 0.37) {
    const auto before = path.at(s - kStep_m), now = path.at(s), after = path.at(s + kStep_m);
    const Eigen::Vector2d slope = (after.position - before.position) / (2.0 * kStep_m);
    const Eigen::Vector2d bend = (after.tangent - before.tangent) / (2.0 * kStep_m);
    CAPTURE(s);
    CHECK((slope - now.tangent).norm() < 2e-3);  // the way is exact to 0.2 %
    CHECK(now.tangent.norm() == Approx(1.0));
    const Eigen::Vector2d left(-now.tangent.y(), now.tangent.x());
    CHECK(bend.dot(left) == Approx(now.curvature).margin(1e-3));
  }
}

TEST_CASE("A path is closed and periodic", "[motion]") {
  const RoutePath path(kBlock, 5.0);
  for (const double s : {0.0, 10.0, 77.7}) {
    CHECK((path.at(s).position - path.at(s + path.length_m()).position).norm() < 1e-9);
    CHECK((path.at(s).position - path.at(s + 3.0 * path.length_m()).position).norm() < 1e-9);
  }
  constexpr double kStep_m = 1e-6;
  const auto end = path.at(path.length_m() - kStep_m), start = path.at(kStep_m);
  CHECK((end.position - start.position).norm() < 1e-5);
  CHECK((end.tangent - start.tangent).norm() < 1e-5);
  CHECK(std::abs(end.curvature - start.curvature) < 1e-4);
}

TEST_CASE("The path begins at the begin of the route", "[motion]") {
  const Route route{{{40, 0}, {80, 0}, {80, 50}, {0, 50}, {0, 0}}, 6.0};  // starts on a straight
  const RoutePath path(route, 5.0);
  CHECK((path.at(0.0).position - Eigen::Vector2d(40, 0)).norm() < 0.02);
  CHECK((path.at(10.0).position - Eigen::Vector2d(50, 0)).norm() < 0.05);
  CHECK(path.at(0.0).tangent.x() == Approx(1.0));
}

TEST_CASE("Corners closer together than their arcs are rounded as far as the room allows",
          "[motion]") {
  // A chicane of 4 m pieces with a radius of 10 m.
  const Route route{{{0, 0}, {20, 0}, {20, 4}, {24, 4}, {24, 0}, {60, 0}, {60, 40}, {0, 40}}, 6.0};
  const RoutePath path(route, 10.0);
  for (double s = 0.0; s < path.length_m(); s += 0.2) {
    CHECK(distance_to(route, path.at(s).position) < 3.1);
    CHECK(std::abs(path.at(s).curvature) < 0.6);
  }
}

TEST_CASE("A path refuses routes that cannot be driven", "[motion]") {
  const auto refused = [](const Route& route, double radius) {
    CHECK_THROWS_AS(RoutePath(route, radius), std::invalid_argument);
  };
  refused({{}, 6.0}, 5.0);
  refused({{{0, 0}, {100, 0}}, 6.0}, 5.0);
  refused({{{0, 0}, {100, 0}, {100, 0}, {0, 0}}, 6.0}, 5.0);  // two different points
  refused({{{0, 0}, {1, 0}, {1, 1}}, 6.0}, 5.0);              // 3.4 m long
  refused({{{0, 0}, {100, 0}, {std::nan(""), 50}}, 6.0}, 5.0);
  refused(kBlock, 0.0);
  refused(kBlock, std::nan(""));
}

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
