#pragma once

#include <array>
#include <cstdint>

#include "apps/lab/simulation/world/scene.hpp"

namespace km {

/// All parameters of a facade: equal styles give equal facades.
struct FacadeStyle {
  enum class Window : std::uint8_t {
    kCasement,
    kSash,
    kPane
  };  ///< Two wings below a transom; one
      ///< sash above the other; one pane.
  enum class GroundFloor : std::uint8_t { kWindows, kShops, kGarages };

  std::uint64_t seed = 0;  ///< Seed of blinds, doors and signs.
  int floors = 4;          ///< Ground floor included.
  float ground_floor_m = 3.8F;
  float floor_m = 3.0F;
  float bay_m = 2.8F;  ///< Approximate distance between windows: bays divide the width evenly.
  float window_width_m = 1.15F;
  float window_height_m = 1.65F;
  float sill_m = 0.85F;    ///< Height of the window above its floor.
  float recess_m = 0.16F;  ///< Depth of the glass behind the wall.
  Window window = Window::kCasement;
  GroundFloor ground_floor = GroundFloor::kWindows;
  bool surrounds = false;  ///< Stone frames around windows.
  bool shutters = false;   ///< Open shutters beside windows.
  bool balconies = false;  ///< Balconies in every third bay.
  bool string_courses = true;
  bool cornice = true;
  bool downpipe = true;
  MaterialId wall = 0;
  MaterialId base = 0;     ///< Wall of the ground floor.
  MaterialId trim = 0;     ///< Sills, surrounds, courses, cornice.
  MaterialId frame = 0;    ///< Window frames.
  MaterialId shutter = 0;  ///< Material of shutters and doors.
};

/// Kind of one of the four walls: facade with windows, few small windows, no windows, no wall.
enum class WallKind : std::uint8_t { kRich, kPlain, kBlind, kNone };

/// A house on a rectangle: walls of x from 0 to width, of y from 0 to depth, front at y = 0.
struct Building {
  float width_m = 10.0F;
  float depth_m = 10.0F;
  FacadeStyle style;
  bool ridge = false;  ///< Roof with a ridge along x and gables at both ends; otherwise flat, with
                       ///< machines on it.
  MaterialId roofing = 0;
  /// Walls in the order front (y = 0), right, back, left.
  std::array<WallKind, 4> walls = {WallKind::kRich, WallKind::kBlind, WallKind::kPlain,
                                   WallKind::kBlind};
};

void add_building(Scene& scene, const Building& building);

/// A style drawn from those of one old town: brick, coloured plaster, stone, concrete panels.
[[nodiscard]] Building random_building(Scene& scene, std::uint64_t seed);

}  // namespace km
