#pragma once

#include <filesystem>
#include <vector>

#include "modules/core/geometry.hpp"

namespace km {

/// The transform from the frame of the estimated trajectories to that of the reference ones, by
/// align_surroundings(): what robots saw is put where it belongs. Reference i is that of
/// trajectory i, of which there may be more; a single reference with `one_for_all` is that of every
/// trajectory. Identity without references. Throws an exception whose message is one line.
[[nodiscard]] SE3 placement_of(const std::vector<std::filesystem::path>& trajectories,
                               const std::vector<std::filesystem::path>& references,
                               bool one_for_all);

}  // namespace km
