#pragma once

#include <Eigen/Core>
#include <array>

#include "modules/simulation/rendering/light_volume.hpp"
#include "modules/simulation/rendering/ray_tracer.hpp"
#include "modules/simulation/rendering/sky.hpp"
#include "modules/simulation/rendering/surface_table.hpp"
#include "modules/simulation/world/world.hpp"

namespace km {

/// A world made ready for rendering. Immutable.
struct RenderScene {
  explicit RenderScene(const World& world);

  const Lighting lighting;
  const SurfaceTable surfaces;
  const RayTracer tracer;
  const Sky sky;
  const LightVolume light;
};

/// Radiance along one ray, split by what a shadow would take away. Value is float (grey) or
/// Eigen::Vector3f (colour).
template <typename Value>
struct Shade {
  Value ambient;  ///< All but the sun.
  Value sun;      ///< What the sun adds where it is not hidden.
};

/// Up to sixteen rays that hit something, and what is needed to shade and to shadow their ends.
struct SurfaceHits {
  RayPacket rays;        ///< Traced; directions have z = 1 in the camera frame, so tfar is depth.
  LaneMask active = 0;   ///< Lanes that belong to the image.
  LaneMask surface = 0;  ///< Of these, lanes that hit a surface; the others see the sky.
  /// Change of the direction per pixel to the right and down.
  Lanes right_x, right_y, right_z, down_x, down_y, down_z;
};

/// Geometry of the points that were hit, lane by lane.
struct SurfacePoints {
  std::array<Eigen::Vector3f, kLanes> position;
  std::array<Eigen::Vector3f, kLanes> plane_normal;  ///< Towards the viewer.
  std::array<Eigen::Vector3f, kLanes> normal;        ///< For shading, towards the viewer.
  std::array<const ShadingMaterial*, kLanes> material;
  Lanes u, v;              ///< Texture coordinates [m].
  Lanes major_u, major_v;  ///< Longer axis of a pixel's footprint [m].
  Lanes major_m, minor_m;  ///< Its axes' lengths [m].
};

/// Computes positions, normals and texture footprints (exact ray differentials: Igehy, "Tracing Ray
/// Differentials", 1999).
void locate(const SurfaceTable& surfaces, const SurfaceHits& hits, SurfacePoints& points);

/// Lanes of `wanted` whose points the sun does not reach: shadowed, or turned away.
[[nodiscard]] LaneMask shadowed(const RenderScene& scene, LaneMask wanted,
                                const SurfacePoints& points);

/// Radiance of each active lane, haze included.
template <typename Value>
void shade(const RenderScene& scene, const SurfaceHits& hits, const SurfacePoints& points,
           LaneMask wanted, std::array<Shade<Value>, kLanes>& shades);

}  // namespace km
