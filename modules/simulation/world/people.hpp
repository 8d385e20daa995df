#pragma once

#include "modules/simulation/world/scene.hpp"

namespace km {

/// A standing or striding person, 1.6 to 1.9 m tall.
void add_person(Scene& scene, SeededRandom& random);

}  // namespace km
