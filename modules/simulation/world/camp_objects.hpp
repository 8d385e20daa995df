#pragma once

#include <Eigen/Core>

#include "modules/simulation/world/scene.hpp"

namespace km {

/// A freight container, 6.06 m along x, 2.44 m wide, 2.59 m tall; doors at +x.
void add_container(Scene& scene, SeededRandom& random);

/// Stacks of boxes with battens.
void add_crates(Scene& scene, SeededRandom& random);
void add_barrels(Scene& scene, SeededRandom& random);
/// A wall of sandbags from x = 0 to `length_m`.
void add_sandbags(Scene& scene, float length_m, SeededRandom& random);
void add_rock(Scene& scene, float size_m, SeededRandom& random);
/// Concrete barrier of 3 m along x.
void add_barrier(Scene& scene);
void add_generator(Scene& scene, SeededRandom& random);
void add_toilet_cabin(Scene& scene, SeededRandom& random);
void add_water_tank(Scene& scene, SeededRandom& random);
void add_log_pile(Scene& scene, SeededRandom& random);

}  // namespace km
