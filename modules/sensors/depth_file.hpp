#pragma once

#include <filesystem>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/sensors/image_file.hpp"

namespace km {

using DepthResult = LoadedImage<DepthImage>;

/// Reads a 16-bit image of one channel whose values are depths in units of `scale_m` [m]. No depth:
/// 0, 65535 (what many sensors write), and what lies outside `range` or beyond 65.535 m.
[[nodiscard]] DepthResult load_depth_image(const std::filesystem::path& file, int width, int height,
                                           double scale_m, const DepthRange& range);

}  // namespace km
