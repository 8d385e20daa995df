#pragma once

#include <cstddef>

#include "recorded_tracking.hpp"

namespace km {

/// `recording` as an RGB-D camera in place of the stereo pair would have recorded it: its left
/// images, with depth that StereoDepth makes of both, seen through the left camera's lens. The
/// baseline stays, now virtual. Only every `every`th image has depth, from index `first` on.
[[nodiscard]] Recording as_rgbd(const Recording& recording, std::size_t every = 1,
                                std::size_t first = 0);

}  // namespace km
