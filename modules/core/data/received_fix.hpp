#pragma once

#include <Eigen/Core>
#include <optional>

#include "modules/core/stamp.hpp"

namespace km {

/// A position as its source states it.
struct ReceivedFix {
  Stamp stamp = 0;
  /// GNSS: latitude and longitude [deg], altitude above the ellipsoid [m]. Motion capture: x, y, z
  /// [m].
  Eigen::Vector3d coordinates = Eigen::Vector3d::Zero();
  std::optional<double> sigma_m = {};  ///< On each axis; nullopt: not stated.
};

}  // namespace km
