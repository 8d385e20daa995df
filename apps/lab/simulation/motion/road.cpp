#include "apps/lab/simulation/motion/road.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include "apps/lab/simulation/world/seeded_random.hpp"

namespace km {
namespace {

using Points = std::vector<Eigen::Vector2d>;

constexpr double kSpacing_m = 0.25;
constexpr double kEasing_m =
    0.8;  // standard deviation of the smoothing, for the time that steering takes
constexpr double kStraight = 1e-4;  // smallest angle of a corner [rad]

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// Points of the arc that rounds the corner at `corner`; the corner itself if the path is straight.
void append_corner(const Eigen::Vector2d& before, const Eigen::Vector2d& corner,
                   const Eigen::Vector2d& after, double radius_m, Points& out) {
  const Eigen::Vector2d in = (corner - before).normalized();
  const Eigen::Vector2d onward = (after - corner).normalized();
  const double turn = std::atan2(cross(in, onward), in.dot(onward));
  if (std::abs(turn) < kStraight) {
    out.push_back(corner);
    return;
  }
  const double room = 0.5 * std::min((corner - before).norm(), (after - corner).norm());
  const double tan_half = std::tan(0.5 * std::abs(turn));
  const double cut =
      std::min(radius_m * tan_half, room);  // distance from the corner to the begin of the arc
  const double radius = cut / tan_half;
  const Eigen::Vector2d begin = corner - cut * in;
  const Eigen::Vector2d left(-in.y(), in.x());
  const Eigen::Vector2d center = begin + (turn > 0.0 ? radius : -radius) * left;
  const int steps = 1 + static_cast<int>(std::abs(turn) * radius / kSpacing_m);
  for (int k = 0; k <= steps; ++k)
    out.push_back(center + Eigen::Rotation2Dd(turn * k / steps) * (begin - center));
}

Points rounded(const Points& points, double radius_m) {
  const std::size_t n = points.size();
  Points out;
  for (std::size_t k = 0; k < n; ++k)
    append_corner(points[(k + n - 1) % n], points[k], points[(k + 1) % n], radius_m, out);
  // The first corner's arc begins before the first point. The path starts at the point nearest to
  // it, the middle of that arc; rotating the list by whole points is exact enough.
  const auto nearest = std::min_element(out.begin(), out.end(), [&](const auto& a, const auto& b) {
    return (a - points[0]).squaredNorm() < (b - points[0]).squaredNorm();
  });
  std::rotate(out.begin(), nearest, out.end());
  return out;
}

double closed_length(const Points& points) {
  double length = 0.0;
  for (std::size_t k = 0; k < points.size(); ++k)
    length += (points[(k + 1) % points.size()] - points[k]).norm();
  return length;
}

// `count` points at equal distances along the closed polyline.
Points resampled(const Points& points, std::size_t count) {
  const double step = closed_length(points) / static_cast<double>(count);
  Points out;
  std::size_t k = 0;
  double passed = 0.0;  // way at points[k]
  for (std::size_t i = 0; i < count; ++i) {
    const double way = step * static_cast<double>(i);
    for (;; ++k) {
      const Eigen::Vector2d& a = points[k % points.size()];
      const Eigen::Vector2d& b = points[(k + 1) % points.size()];
      const double edge = (b - a).norm();
      if (passed + edge >= way && edge > 0.0) {
        out.push_back(a + (way - passed) / edge * (b - a));
        break;
      }
      passed += edge;
    }
  }
  return out;
}

// Gaussian weights over equidistant points, around the ring.
Points smoothed(const Points& points, double sigma_points) {
  const int reach = static_cast<int>(std::ceil(4.0 * sigma_points));
  const int n = static_cast<int>(points.size());
  Points out;
  for (int i = 0; i < n; ++i) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double weights = 0.0;
    for (int d = -reach; d <= reach; ++d) {
      const double weight = std::exp(-0.5 * d * d / (sigma_points * sigma_points));
      sum += weight * points[static_cast<std::size_t>(((i + d) % n + n) % n)];
      weights += weight;
    }
    out.push_back(sum / weights);
  }
  return out;
}

// Control k of the spline is point k - 2, so that the curve starts at point 0.
UniformSpline<2> closed_spline(const Route& route, double radius_m) {
  const Points arcs = rounded(route.points, radius_m);
  const auto count = static_cast<std::size_t>(std::ceil(closed_length(arcs) / kSpacing_m));
  const Points eased = smoothed(resampled(arcs, count), kEasing_m / kSpacing_m);
  const Points even = resampled(eased, count);
  Points controls;
  for (std::size_t k = 0; k < count + 5; ++k) controls.push_back(even[(k + count - 2) % count]);
  return {0.0, closed_length(even) / static_cast<double>(count), std::move(controls)};
}

constexpr double kInterval_m = 0.1;
constexpr double kDensity_m3 = 16e-6;        // at kReferenceFrequency: geometric mean of class A
constexpr double kReferenceFrequency = 0.1;  // [cycles/m]
constexpr double kMemory_m = 15.0;           // distance after which a height has no influence

// A density that falls with the square of the frequency is that of a random walk. Its slope is
// white, with the one-sided density (2 pi n)^2 G(n); half of that is the variance of the increments
// per metre. The walk leaks, which keeps it near 0.
UniformSpline<1> random_walk(double begin_m, double end_m, double roughness, std::uint64_t seed) {
  const double turn = 2.0 * std::numbers::pi * kReferenceFrequency;
  const double step = roughness * std::sqrt(0.5 * turn * turn * kDensity_m3 * kInterval_m);
  const double leak = std::exp(-kInterval_m / kMemory_m);
  GaussianRandom random{SeededRandom(seed)};
  std::vector<UniformSpline<1>::Vector> heights;
  UniformSpline<1>::Vector height(step / std::sqrt(1.0 - leak * leak) * random.draw());
  const int intervals = static_cast<int>(std::ceil((end_m - begin_m) / kInterval_m));
  for (int k = -5; k < intervals; ++k) {
    heights.push_back(height);
    height[0] = leak * height[0] + step * random.draw();
  }
  return {begin_m, kInterval_m, std::move(heights)};
}

}  // namespace

RoutePath::RoutePath(const Route& route, double corner_radius_m)
    : curve_(closed_spline(route, corner_radius_m)) {}

RoutePath::Point RoutePath::at(double way_m) const {
  const double around = way_m - std::floor(way_m / length_m()) * length_m();
  const auto sample = curve_.at(around);
  const double speed = sample.first.norm();
  return {sample.value, sample.first / speed,
          cross(sample.first, sample.second) / (speed * speed * speed)};
}

RoadProfile::RoadProfile(double begin_m, double end_m, double roughness, std::uint64_t seed)
    : curve_(random_walk(begin_m, end_m, roughness, seed)) {}

}  // namespace km
