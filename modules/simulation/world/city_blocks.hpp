#pragma once

#include "modules/simulation/world/city_plan.hpp"
#include "modules/simulation/world/scene.hpp"

namespace km {

/// Houses, gardens and the park behind the building lines of the blocks, and the houses outside the
/// grid.
void add_blocks(Scene& scene, const CityPlan& plan, std::uint64_t seed);

/// What stands on the sidewalks and in the parking lanes of one street side.
void add_sidewalk_objects(Scene& scene, const StreetSide& side, SeededRandom& random);

}  // namespace km
