#pragma once

#include <memory>

#include "recorded_tracking.hpp"

namespace km {

/// `recording` as an RGB-D camera in place of the stereo pair would have recorded it: its left
/// images, with depth made from both by semi-global matching (Hirschmueller 2008, OpenCV's). The
/// baseline stays, now virtual.
[[nodiscard]] Recording as_rgbd(const Recording& recording);

}  // namespace km
