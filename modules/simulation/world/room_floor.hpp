#pragma once

#include "modules/simulation/world/scene.hpp"
#include "modules/simulation/world/seeded_random.hpp"

namespace km {

/// Carpet, printed mats, strips of marker tape, papers and scraps on the rectangle
/// [0, width] x [0, depth] of the builder's current frame. Nothing is higher than 2 cm.
void add_room_floor(Scene& scene, float width_m, float depth_m, SeededRandom& random);

}  // namespace km
