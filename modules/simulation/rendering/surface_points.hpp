#pragma once

#include <array>

#include "modules/simulation/rendering/lanes.hpp"
#include "modules/simulation/rendering/ray_tracer.hpp"
#include "modules/simulation/rendering/surface_table.hpp"

namespace km {

/// Up to sixteen rays that hit something, and what is needed to shade and to shadow their ends.
struct SurfaceHits {
  RayPacket rays;        ///< Traced; directions have z = 1 in the camera frame, so tfar is depth.
  LaneMask active = 0;   ///< Lanes that belong to the image.
  LaneMask surface = 0;  ///< Of these, lanes that hit a surface; the others see the sky.
  Lanes3 right, down;    ///< Change of the direction per pixel to the right and down.
};

/// Geometry of the points that were hit, lane by lane. Lanes that hit nothing hold the geometry of
/// one that did, seen along another ray: finite, of no meaning.
struct SurfacePoints {
  Lanes3 view;          ///< Unit vector along the ray.
  Lanes distance_m;     ///< Along the ray.
  Lanes3 position;      ///< [m]
  Lanes3 plane_normal;  ///< Towards the viewer.
  Lanes3 normal;        ///< For shading, towards the viewer.
  std::array<const ShadingMaterial*, kLanes> material;
  Lanes u, v;              ///< Texture coordinates [m].
  Lanes major_u, major_v;  ///< Longer axis of a pixel's footprint [m].
  Lanes major_m, minor_m;  ///< Its axes' lengths [m].
};

/// Computes positions, normals and texture footprints (exact ray differentials: Igehy, "Tracing Ray
/// Differentials", 1999) of hits.surface; nothing if that is empty.
void locate(const SurfaceTable& surfaces, const SurfaceHits& hits, SurfacePoints& points);

}  // namespace km
