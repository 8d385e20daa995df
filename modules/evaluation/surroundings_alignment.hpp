#pragma once

#include <span>

#include "modules/evaluation/trajectory_error.hpp"

namespace km {

/// The rigid transform T_truth_estimate that best puts what robots saw where it is: of least
/// squared distance between six points around each estimated pose, `radius_m` from it along its
/// axes, and the same around the true one. align() looks at positions alone, which leave a map's
/// roll open where the way was straight, and turn it where the way is short. All estimates are
/// moved by the one transform. Throws std::invalid_argument, naming the estimate, if one shares no
/// pose with its truth, and for no input.
[[nodiscard]] SE3 align_surroundings(std::span<const TrajectoryInput> inputs, double radius_m = 5.0,
                                     const TrajectoryErrorOptions& options = {});

}  // namespace km
