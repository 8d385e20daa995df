#pragma once

#include "modules/simulation/rendering/lanes.hpp"
#include "modules/simulation/rendering/surface_points.hpp"

namespace km {

/// A texture averaged over a pixel's footprint: `count` round samples of width `width_m`, side by
/// side along its longer axis. In metres on the surface.
struct Taps {
  Lanes first_u, first_v, step_u, step_v;
  Lanes width_m;
  IntLanes count;
};

[[nodiscard]] Taps taps_of(const SurfacePoints& points);

/// Luminance of the albedo of each lane's material: tint * base * detail.
[[nodiscard]] Lanes gray_albedo(const SurfacePoints& points, const Taps& taps);

}  // namespace km
