#pragma once

#include "modules/simulation/world/scene.hpp"

namespace km {

/// A broad-leaved tree: trunk, two orders of branches, leaf clusters at their ends. Nothing of the
/// crown hangs below `clear_m`.
struct TreeShape {
  float height_m = 8.0F;
  float crown_radius_m = 2.4F;
  float clear_m = 2.8F;
  int leaves = 1400;
  float leaf_m = 0.36F;
};
void add_tree(Scene& scene, const TreeShape& shape, SeededRandom& random);

/// A fir: tiers of drooping branches down to the ground.
void add_conifer(Scene& scene, float height_m, SeededRandom& random);

void add_bush(Scene& scene, float radius_m, SeededRandom& random);

/// A clipped hedge from x = 0 to `length_m`, its front at y = 0.
void add_hedge(Scene& scene, float length_m, float depth_m, float height_m, SeededRandom& random);

/// A tuft of grass blades.
void add_tuft(Scene& scene, float height_m, SeededRandom& random);

}  // namespace km
