#pragma once

#include <Eigen/Core>

#include "modules/core/map/label_palette.hpp"

namespace km {

/// An object as a point for the match of two constellations, in a frame with z up.
///
/// A box contains only what its robot saw of the object. Its centre is therefore shifted towards
/// the robot: a robot on the other side finds another centre. Such shifts may be equal for all
/// objects of a robot, so they are kept apart from independent errors.
struct Landmark {
  LabelId label = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< [m]
  /// Longer horizontal side, shorter horizontal side, height [m].
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
  double sigma_m = 0.1;  ///< Standard deviation of the independent error of the centre, per axis.
  double side_shift_m = 0.0;    ///< Standard deviation of the shift along each horizontal axis.
  double height_shift_m = 0.0;  ///< Standard deviation of the shift along z.

  /// Variance of a horizontal coordinate [m^2].
  [[nodiscard]] double side_variance() const {
    return sigma_m * sigma_m + side_shift_m * side_shift_m;
  }
  /// Variance of z [m^2].
  [[nodiscard]] double height_variance() const {
    return sigma_m * sigma_m + height_shift_m * height_shift_m;
  }
};

/// One object, as robot a and as robot b mapped it.
struct LandmarkPair {
  Landmark a;
  Landmark b;

  [[nodiscard]] double side_variance() const { return a.side_variance() + b.side_variance(); }
  [[nodiscard]] double height_variance() const { return a.height_variance() + b.height_variance(); }
};

}  // namespace km
