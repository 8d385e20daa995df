#pragma once

#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// A pose at an instant; its user defines the frames.
struct StampedPose {
  Stamp stamp = 0;
  SE3 T = SE3::Identity();
};

/// Poses of a file with their covariances, see core/covariance.hpp.
struct UncertainTrajectory {
  std::vector<StampedPose> poses;
  std::vector<Matrix6> covariances;  ///< Zero: unknown.
  std::vector<int> lines;            ///< Their lines in the file.
};

}  // namespace km
