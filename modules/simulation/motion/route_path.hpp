#pragma once

#include <Eigen/Core>

#include "modules/simulation/motion/uniform_spline.hpp"
#include "modules/simulation/world/world.hpp"

namespace km {

/// A route as a wheel rolls along it: corners rounded to arcs, curvature continuous. Closed; its
/// parameter is the way along it [m].
class RoutePath {
 public:
  struct Point {
    Eigen::Vector2d position = Eigen::Vector2d::Zero();  ///< [m]
    Eigen::Vector2d tangent = Eigen::Vector2d::UnitX();  ///< Unit length.
    double curvature = 0.0;                              ///< Left turns are positive [1/m].
  };

  /// Arcs of `corner_radius_m`, smaller where the pieces beside a corner are too short. Throws
  /// std::invalid_argument for fewer than three different points, points that are not finite, or a
  /// way shorter than 20 m.
  RoutePath(const Route& route, double corner_radius_m);

  [[nodiscard]] double length_m() const { return curve_.end(); }

  /// At `way_m` from where the route begins; beyond the end it goes round again.
  [[nodiscard]] Point at(double way_m) const;

 private:
  UniformSpline<2> curve_;
};

}  // namespace km
