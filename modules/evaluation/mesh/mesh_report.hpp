#pragma once

#include <string>

#include "modules/core/io/json.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/evaluation/mesh/mesh_error.hpp"

namespace km {

/// Tables for people: distances and label accuracy per robot and merged, then accuracy per class of
/// the merged mesh, then registration and notes. Classes are named by the palette, or else by
/// number.
[[nodiscard]] std::string to_table(const MeshReport& report, const LabelPalette& palette);

/// The report as one JSON object. Labels that are not judged and numbers of empty samples are null.
[[nodiscard]] Json to_json(const MeshReport& report, const LabelPalette& palette);

}  // namespace km
