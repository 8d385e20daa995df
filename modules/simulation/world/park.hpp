#pragma once

#include "modules/simulation/world/city_plan.hpp"
#include "modules/simulation/world/scene.hpp"

namespace km {

/// A block of trees, lawns, gravel paths, benches and a monument behind hedges and railings.
void add_park(Scene& scene, const Eigen::AlignedBox2f& kerb, SeededRandom& random);

}  // namespace km
