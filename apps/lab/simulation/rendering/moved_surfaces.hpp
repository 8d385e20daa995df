#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "apps/lab/simulation/rendering/ray_tracer.hpp"
#include "apps/lab/simulation/rendering/surfaces.hpp"
#include "apps/lab/simulation/world/world.hpp"
#include "modules/core/geometry.hpp"

namespace km {

/// Surfaces of things that move, where they are at one instant. Immutable.
class MovedSurfaces {
 public:
  /// `shapes`: a world whose objects are the things, each in its own frame. `poses[i]` is the pose
  /// of shapes.objects[i]. `shapes` must outlive this. Throws std::invalid_argument unless there is
  /// one pose for each object, and an object has all triangles.
  MovedSurfaces(const World& shapes, std::span<const SE3> poses);
  MovedSurfaces(const MovedSurfaces&) = delete;
  MovedSurfaces& operator=(const MovedSurfaces&) = delete;

  [[nodiscard]] const SurfaceTable& surfaces() const { return surfaces_; }
  [[nodiscard]] const RayTracer& tracer() const { return tracer_; }

 private:
  SurfaceMesh mesh_;
  SurfaceTable surfaces_;
  RayTracer tracer_;
};

}  // namespace km
