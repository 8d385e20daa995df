#pragma once

#include <cstddef>

#include "recorded_tracking.hpp"

namespace km {

/// `recording` as an RGB-D camera in place of the stereo pair would have recorded it: its left
/// images, with depth made from both by semi-global matching (Hirschmueller 2008, OpenCV's). The
/// baseline stays, now virtual. Only every `every`th image has depth, from index `first` on.
[[nodiscard]] Recording as_rgbd(const Recording& recording, std::size_t every = 1,
                                std::size_t first = 0);

}  // namespace km
