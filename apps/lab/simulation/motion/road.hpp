#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "apps/lab/simulation/motion/spline_trajectory.hpp"
#include "apps/lab/simulation/world/world.hpp"

namespace km {

/// The path of a wheel along a route: corners rounded to arcs, continuous curvature. It is closed;
/// its parameter is the distance along it [m].
class RoutePath {
 public:
  struct Point {
    Eigen::Vector2d position = Eigen::Vector2d::Zero();  ///< [m]
    Eigen::Vector2d tangent = Eigen::Vector2d::UnitX();  ///< Unit length.
    double curvature = 0.0;                              ///< Left turns are positive [1/m].
  };

  /// Arcs of `corner_radius_m`, smaller at corners between short segments. Precondition: at least
  /// three different points, over at least 20 m.
  RoutePath(const Route& route, double corner_radius_m);

  [[nodiscard]] double length_m() const { return curve_.end(); }

  /// Point at `way_m` from the begin of the route; periodic beyond the end.
  [[nodiscard]] Point at(double way_m) const;

 private:
  UniformSpline<2> curve_;
};

/// Unevenness of the road under one wheel track by the way along it, frozen in space.
class RoadProfile {
 public:
  /// Covers distances from `begin_m` to `end_m`. `roughness` scales heights: 1 is a street of ISO
  /// 8608 class A. That class has the one-sided displacement density 16e-6 m^3 at 0.1 cycles per
  /// metre. The density falls with the square of the frequency. Below one cycle in about 100 m it
  /// is zero, because the world's own ground has these frequencies. Above one in about 0.3 m a tyre
  /// averages it.
  RoadProfile(double begin_m, double end_m, double roughness, std::uint64_t seed);

  [[nodiscard]] double height_m(double way_m) const { return curve_.at(way_m).value[0]; }

 private:
  UniformSpline<1> curve_;
};

}  // namespace km
