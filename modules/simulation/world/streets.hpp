#pragma once

#include "modules/simulation/world/city_plan.hpp"
#include "modules/simulation/world/scene.hpp"

namespace km {

/// Everything flat: asphalt with patches, lane lines, crosswalks, arrows and manholes, kerbs,
/// sidewalks, the ground inside the blocks. Level: CityPlan::ground() is added later.
void add_streets(Scene& scene, const CityPlan& plan, SeededRandom& random);

}  // namespace km
