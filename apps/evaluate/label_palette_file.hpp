#pragma once

#include <filesystem>

#include "modules/core/label_palette.hpp"

namespace km {

/// Reads a palette's table. Throws an exception whose one line names the file and what is wrong.
[[nodiscard]] LabelPalette read_label_palette(const std::filesystem::path& file);

/// label_palette.csv in the folder of `mesh`, where the simulator puts it and robots do; empty if
/// there is none.
[[nodiscard]] std::filesystem::path palette_beside(const std::filesystem::path& mesh);

}  // namespace km
