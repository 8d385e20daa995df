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

  /// Arcs of `corner_radius_m`, smaller at corners between short segments. Throws
  /// std::invalid_argument for fewer than three different points, points that are not finite, or a
  /// path shorter than 20 m.
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

/// Heave, pitch and roll of a body on its springs.
struct SprungBody {
  double heave_m = 0.0;    ///< Height of the point midway between the wheels.
  double pitch_rad = 0.0;  ///< About the y axis (left): nose down is positive.
  double roll_rad = 0.0;   ///< About the x axis (forward): leaning right is positive.
};

/// Heave, pitch and roll, each two oscillators in a row: the wheels on their tyres follow the
/// ground u, the body on its springs follows the wheels w,
///   w'' = -2 zeta_t a w' - a^2 (w - u),
///   x'' = -2 zeta b (x' - w') - b^2 (x - w).
/// For pitch and roll, u is the ground's slope plus the effect of the vehicle's acceleration: nose
/// down under braking, leaning outwards in curves.
class Suspension {
 public:
  /// Starts at rest on `ground`.
  explicit Suspension(const SprungBody& ground);

  /// State of the body after `dt_s`, in which the ground moves linearly to `ground`, at the
  /// vehicle's acceleration forward and to the left [m/s^2]. Exactly at rest while nothing changes.
  SprungBody step(const SprungBody& ground, double forward_mps2, double left_mps2, double dt_s);

 private:
  class Axis {
   public:
    explicit Axis(double at_rest) : ground_(at_rest), wheels_(at_rest), body_(at_rest) {}
    double advance(double next_ground, double frequency_hz, double dt_s);

   private:
    double ground_, wheels_, body_;
    double wheels_rate_ = 0.0, body_rate_ = 0.0;
  };
  Axis heave_, pitch_, roll_;
};

}  // namespace km
