#pragma once

#include <span>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/odometry.hpp"

namespace km {

/// Errors of a trajectory against the true poses of the same instants.
struct OdometryErrors {
  double ate_m = 0.0;  ///< Root mean square after SE(3) alignment.
  double max_m = 0.0;  ///< Largest after that alignment.
  double rpe_m = 0.0;  ///< Root mean square over all pairs 1 s apart.
  double rpe_deg = 0.0;
  double tilt_deg = 0.0;  ///< Root mean square angle between the verticals, no alignment.
  double scale = 1.0;     ///< That Sim(3) alignment would apply to the estimate.
};

/// `truth[k]` belongs to `states[k]`; at least three of each.
[[nodiscard]] OdometryErrors odometry_errors(std::span<const OdometryState> states,
                                             std::span<const SE3> truth);

}  // namespace km
