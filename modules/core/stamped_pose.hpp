#pragma once

#include "modules/core/geometry.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// A pose at an instant; the frames are named where it is used.
struct StampedPose {
  Stamp stamp = 0;
  SE3 T = SE3::Identity();
};

}  // namespace km
