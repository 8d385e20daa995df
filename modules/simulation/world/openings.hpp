#pragma once

#include <span>

#include "modules/simulation/world/facade.hpp"
#include "modules/simulation/world/scene.hpp"

namespace km {

/// A hole in a wall in the plane y = 0 [m].
struct Opening {
  float x0 = 0.0F;
  float x1 = 0.0F;
  float z0 = 0.0F;
  float z1 = 0.0F;

  [[nodiscard]] float width() const { return x1 - x0; }
  [[nodiscard]] float height() const { return z1 - z0; }
};

/// The wall from (0, z0) to (width, z1) around openings that stand in one row, left to right.
void add_pierced_wall(Scene& scene, float width_m, float z0, float z1,
                      std::span<const Opening> openings, MaterialId wall);

/// What sits in an opening; each includes the reveals of the wall.
void add_window(Scene& scene, const Opening& opening, const FacadeStyle& style,
                SeededRandom& random);
void add_door(Scene& scene, const Opening& opening, const FacadeStyle& style, SeededRandom& random);
void add_garage_door(Scene& scene, const Opening& opening, const FacadeStyle& style,
                     SeededRandom& random);
/// A shop's window over its plinth, with a door at one side if `with_door`.
void add_shop_front(Scene& scene, const Opening& opening, const FacadeStyle& style, bool with_door,
                    SeededRandom& random);

/// A board with raised letters on the wall, its lower left corner at (x, z).
void add_sign_board(Scene& scene, float x, float z, float width_m, float height_m,
                    SurfaceClass label, SeededRandom& random);

}  // namespace km
