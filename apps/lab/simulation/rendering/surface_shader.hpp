#pragma once

#include <Eigen/Core>
#include <array>

#include "apps/lab/simulation/rendering/light_volume.hpp"
#include "apps/lab/simulation/rendering/sky.hpp"
#include "apps/lab/simulation/rendering/surfaces.hpp"
#include "apps/lab/simulation/world/world.hpp"

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

/// A scene at one instant.
struct SceneView {
  const RenderScene& fixed;
  const MovedSurfaces* moved = nullptr;  ///< Null: nothing moves.

  [[nodiscard]] SurfaceView surfaces() const {
    return {fixed.surfaces, moved == nullptr ? nullptr : &moved->surfaces()};
  }
  /// Nearest hits, as RayTracer::intersect(); triangles are those of surfaces().
  void intersect(LaneMask active, RayPacket& rays) const;
  /// As RayTracer::occluded().
  [[nodiscard]] LaneMask occluded(LaneMask active, RayPacket& rays) const;
};

/// Radiance along one ray, split into two parts, of which a shadow removes one.
struct Shade {
  float ambient = 0.0F;  ///< All light except for the sun.
  float sun = 0.0F;      ///< Light of the sun if it is not hidden.
};
using Shades = std::array<Shade, kLanes>;

/// Lanes of `wanted` that the sun does not reach: in shadow, or turned away from it. Precondition:
/// all lanes of `wanted` have been located.
[[nodiscard]] LaneMask shadowed(const SceneView& scene, LaneMask wanted,
                                const SurfacePoints& points);

/// Radiance of each wanted lane, haze included; undefined for the other lanes. Precondition: the
/// lanes of `wanted` that are in hits.surface have been located.
void shade(const RenderScene& scene, const SurfaceHits& hits, const SurfacePoints& points,
           LaneMask wanted, Shades& shades);

}  // namespace km
