#pragma once

#include <array>
#include <cstdint>

#include "modules/simulation/world/facade.hpp"

namespace km {

enum class RoofKind : std::uint8_t {
  kFlat,   ///< With a parapet and machines.
  kRidge,  ///< Ridge along x, gables at both ends.
};

/// How one of the four walls is made.
enum class WallKind : std::uint8_t { kRich, kPlain, kBlind, kNone };

/// A house on a rectangle: walls of x from 0 to width, of y from 0 to depth, front at y = 0.
struct Building {
  float width_m = 10.0F;
  float depth_m = 10.0F;
  FacadeStyle style;
  RoofKind roof = RoofKind::kFlat;
  MaterialId roofing = 0;
  /// Front (y = 0), right, back, left.
  std::array<WallKind, 4> walls = {WallKind::kRich, WallKind::kBlind, WallKind::kPlain,
                                   WallKind::kBlind};
};

void add_building(Scene& scene, const Building& building);

/// A style drawn from those of one old town: brick, coloured plaster, stone, concrete panels.
[[nodiscard]] Building random_building(Scene& scene, std::uint64_t seed);

}  // namespace km
