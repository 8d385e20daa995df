#pragma once

#include <cstddef>
#include <filesystem>

#include "modules/core/frame.hpp"
#include "modules/core/label_palette.hpp"
#include "modules/sensors/image_file.hpp"

namespace km {

struct LabelResult : LoadedImage<LabelImage> {
  std::size_t unknown_pixels = 0;  ///< Of a colour that the palette does not have: id 0.
};

/// Reads a label image: 8 bits of one channel are ids; of three or four channels colours, mapped to
/// ids by `palette` (Kimera-Semantics' format), transparency ignored.
[[nodiscard]] LabelResult load_label_image(const std::filesystem::path& file, int width, int height,
                                           const LabelPalette& palette);

}  // namespace km
