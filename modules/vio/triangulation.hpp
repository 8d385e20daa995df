#pragma once

#include "modules/vio/window.hpp"

namespace km {

/// Sets landmark.p_odom and `located` from its observations and the window's poses: the point
/// nearest to all rays, refined on the reprojection errors (Gauss-Newton). It stays unlocated if
/// it comes to lie behind a camera, if an error exceeds `max_error` [standard deviations, root mean
/// square], or if its distance along the last ray is uncertain by more than a third.
void locate(const Window& window, double max_error, WindowLandmark& landmark);

}  // namespace km
