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
/// align_surroundings(): what robots saw is put where it belongs. Reference i is that of
/// trajectory i, of which there may be more; a single reference with `one_for_all` is that of every
/// trajectory. Identity without references. Throws an exception whose message is one line.
[[nodiscard]] SE3 placement_of(const std::vector<std::filesystem::path>& trajectories,
                               const std::vector<std::filesystem::path>& references,
                               bool one_for_all);

/// The palette in `file`, or else in label_palette.csv beside `mesh`, where the simulator puts it
/// and robots do; empty if there is neither. Throws an exception whose one line names the file and
/// what is wrong with it, or one of `meshes` and a label that it does not have.
[[nodiscard]] LabelPalette read_palette(std::filesystem::path file,
                                        const std::filesystem::path& mesh,
                                        std::span<const MeshInput> meshes);

}  // namespace km
