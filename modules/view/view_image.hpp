#pragma once

#include "modules/core/camera.hpp"
#include "modules/core/tracked_image.hpp"
#include "modules/view/view_update.hpp"

namespace km {

/// The widest image that is told [px].
inline constexpr int kMaxViewWidth = 640;

/// The left image, in grey, no wider than kMaxViewWidth, as a JPEG that fits into an update, and
/// where `camera`, its own, shows the features. Throws std::invalid_argument for an image without
/// pixels.
[[nodiscard]] ViewImage view_image(const TrackedImage& image, const Camera& camera);

}  // namespace km
