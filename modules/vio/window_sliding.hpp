#pragma once

#include <cstddef>

#include "modules/vio/window.hpp"

namespace km {

/// Removes a frame and its observations, and landmarks that no frame sees any more. The inertial
/// factors on its two sides are the caller's.
void forget_frame(Window& window, std::size_t frame);

/// Replaces the oldest frame by a prior on those that it shares information with: its inertial
/// factor, the prior so far, and the observations in keyframes of every landmark that it has seen,
/// linearised at the current estimates, or at the first ones where the prior held a state already.
/// These landmarks begin anew with what later images see of them. The next frame becomes a
/// keyframe: the prior holds it. Precondition: two frames at least, an inertial factor between the
/// first two.
void marginalize_oldest(Window& window);

}  // namespace km
