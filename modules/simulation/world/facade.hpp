#pragma once

#include <cstdint>

#include "modules/simulation/world/scene.hpp"

namespace km {

/// What fills the ground floor.
enum class GroundFloor : std::uint8_t { kWindows, kShops, kGarages };

enum class WindowKind : std::uint8_t {
  kCasement,  ///< Two wings below a transom.
  kSash,      ///< One sash above the other.
  kPane,      ///< A single large pane.
};

/// Everything that decides how a facade looks: equal styles give equal facades.
struct FacadeStyle {
  std::uint64_t seed = 0;  ///< Of blinds, doors, signs.
  int floors = 4;          ///< Ground floor included.
  float ground_floor_m = 3.8F;
  float floor_m = 3.0F;
  float bay_m = 2.8F;  ///< From window to window, about: bays divide the width evenly.
  float window_width_m = 1.15F;
  float window_height_m = 1.65F;
  float sill_m = 0.85F;    ///< Height of the window above its floor.
  float recess_m = 0.16F;  ///< Of the glass behind the wall.
  WindowKind window = WindowKind::kCasement;
  GroundFloor ground_floor = GroundFloor::kWindows;
  bool surrounds = false;  ///< Raised frames of stone around windows.
  bool shutters = false;   ///< Open shutters beside windows.
  bool balconies = false;  ///< In every third bay.
  bool string_courses = true;
  bool cornice = true;
  bool downpipe = true;
  MaterialId wall = 0;
  MaterialId base = 0;     ///< Wall of the ground floor.
  MaterialId trim = 0;     ///< Sills, surrounds, courses, cornice.
  MaterialId frame = 0;    ///< Window frames.
  MaterialId shutter = 0;  ///< Also doors.
};

/// Height of the top of the wall above the street [m].
[[nodiscard]] float height_m(const FacadeStyle& style);

/// A facade from x = 0 to `width_m`, its wall in the plane y = 0.
void add_facade(Scene& scene, const FacadeStyle& style, float width_m);

/// The side of a house that few see: a wall with a few small windows, or none if `blind`.
void add_plain_facade(Scene& scene, const FacadeStyle& style, float width_m, bool blind);

}  // namespace km
