#pragma once

#include "modules/simulation/world/scene.hpp"
#include "modules/simulation/world/seeded_random.hpp"

namespace km {

// Walls of a room and what hangs on them. A wall lies in the plane y = 0 of the builder's current
// frame, x along it from -length / 2 to length / 2, and is seen from -y.

struct WallWindow {
  float center_m = 0.0F;  ///< x
  float width_m = 1.4F;
  float sill_m = 0.85F;
  float top_m = 2.9F;
};

/// A wall with skirting and, if `window` is set, an opening with frame, a bright outside
/// and curtains that let light through.
void add_wall(Scene& scene, float length_m, float height_m, const WallWindow* window,
              SeededRandom& random);

/// A printed sheet of boards that hangs from `top_m` to just above the floor.
void add_plank_sheet(Scene& scene, float width_m, float top_m);
/// Dark ribbed foam, leaning.
void add_foam_panel(Scene& scene, float width_m, float height_m);
/// A print of 0.3 to 0.9 m edge, centred at height `center_m`.
void add_poster(Scene& scene, float edge_m, float center_m, SeededRandom& random);
/// A heavy curtain from `top_m` to the floor.
void add_curtain(Scene& scene, float width_m, float top_m, SeededRandom& random);

/// Ceiling at z = height over [0, width] x [0, depth], with trusses, lamps and cameras below it;
/// returns the lamps' centres in the current frame.
std::vector<Eigen::Vector3f> add_ceiling(Scene& scene, float width_m, float depth_m, float height_m,
                                         SeededRandom& random);

}  // namespace km
