#pragma once

#include "modules/core/geometry.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// A pose at an instant; its user defines the frames.
struct StampedPose {
  Stamp stamp = 0;
  SE3 T = SE3::Identity();
};

}  // namespace km
