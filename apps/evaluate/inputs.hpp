#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/label_palette.hpp"
#include "modules/evaluation/mesh/mesh_error.hpp"

namespace km {

/// "robot0/optimized" for ".../robot0/optimized.tum", "team/robot0" for
/// ".../team.mcap:/robot0/path".
[[nodiscard]] std::string short_name(const std::filesystem::path& file);

/// The transform from the frame of the estimated trajectories to that of the reference ones, by
/// align_surroundings(): it aligns the surroundings that robots saw. Reference i belongs to
/// trajectory i; there may be more trajectories than references. With `one_for_all` a single
/// reference belongs to every trajectory. Identity without references. Throws an exception with a
/// message of one line.
[[nodiscard]] SE3 placement_of(const std::vector<std::filesystem::path>& trajectories,
                               const std::vector<std::filesystem::path>& references,
                               bool one_for_all);

/// The palette in `file`, or else in label_palette.csv beside `mesh`, where the simulator and
/// robots write it; empty if there is neither. Throws an exception with one line that names the
/// file and its fault, or one of `meshes` and a label that the palette lacks.
[[nodiscard]] LabelPalette read_palette(std::filesystem::path file,
                                        const std::filesystem::path& mesh,
                                        std::span<const MeshInput> meshes);

}  // namespace km
