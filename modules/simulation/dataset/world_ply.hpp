#pragma once

#include <cstdint>
#include <vector>

#include "modules/simulation/world/world.hpp"

namespace km {

/// The world's true mesh as binary little-endian PLY: vertices x, y, z [m], faces with their class
/// as `label` and its colour as red, green, blue.
[[nodiscard]] std::vector<std::uint8_t> world_ply(const World& world, const LabelPalette& palette);

}  // namespace km
