#pragma once

#include "modules/simulation/world/scene.hpp"
#include "modules/simulation/world/seeded_random.hpp"

namespace km {

// Furniture and clutter of a room; the conventions are Scene's. "Against the wall" means that the
// back touches the plane y = 0 and nothing lies beyond it.

/// Foam mattress that stands against the wall, leaning by `lean_m` at its foot.
void add_leaning_mattress(Scene& scene, const Eigen::Vector3f& size_m, float lean_m,
                          SeededRandom& random);
/// `count` mattresses of 2 x 1.3 m on each other, centred.
void add_mattress_stack(Scene& scene, int count, SeededRandom& random);

/// Flat board, its lower left corner at the origin, leaning back by `lean_rad`.
void add_board(Scene& scene, float width_m, float height_m, float lean_rad, MaterialId front,
               MaterialId body);

/// Table against the wall, with `clutter` things on it.
void add_table(Scene& scene, float width_m, float depth_m, int clutter, SeededRandom& random);
void add_chair(Scene& scene, SeededRandom& random);
/// Shelves against the wall, full of books, boxes and bottles.
void add_shelf(Scene& scene, float width_m, float height_m, SeededRandom& random);
/// Screen, keyboard and computer on a desk against the wall.
void add_desk(Scene& scene, SeededRandom& random);
void add_radiator(Scene& scene, float width_m);
/// Stepladder, folded, leaning against the wall.
void add_ladder(Scene& scene, float height_m);
/// Stand with clamps, as cameras and lamps are mounted on.
void add_stand(Scene& scene, float height_m, SeededRandom& random);
/// Cardboard or plastic box with a label, centred.
void add_carton(Scene& scene, const Eigen::Vector3f& size_m, SeededRandom& random);
void add_bucket(Scene& scene, SeededRandom& random);

}  // namespace km
