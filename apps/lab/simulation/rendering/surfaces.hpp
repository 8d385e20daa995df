#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "apps/lab/simulation/rendering/ray_tracer.hpp"
#include "apps/lab/simulation/world/world.hpp"
#include "modules/core/geometry/geometry.hpp"

namespace km {

/// Luminance of a linear colour for a grey camera: the weights of ITU-R BT.709.
inline float luminance_of(const Eigen::Vector3f& rgb) {
  return 0.2126F * rgb.x() + 0.7152F * rgb.y() + 0.0722F * rgb.z();
}

/// Data of one triangle for shading, in one cache line.
struct alignas(64) SurfaceRecord {
  Eigen::Vector3f
      normal;  ///< Normal of the plane, unit length, outwards; zero for a triangle without area.
  Eigen::Vector3f u_gradient;  ///< Texture coordinates [m] of a point p of the plane:
  Eigen::Vector3f v_gradient;  ///< gradient * p + offset.
  float u_offset = 0.0F;
  float v_offset = 0.0F;
  std::uint16_t material = 0;
  bool smooth = false;  ///< The vertices' normals differ: they are interpolated.
};

struct TextureLayer {
  Texture::GrayTexels gray;
  float per_m = 1.0F;  ///< Tiles per metre.
};

/// Materials with values that do not depend on the point.
struct ShadingMaterial {
  TextureLayer base;
  TextureLayer detail;
  float tint_luminance = 1.0F;
  float specular = 0.0F;
  float glow = 0.0F;
  float transmission = 0.0F;    ///< Share of light transmitted from behind: leaves, cloth.
  float mean_luminance = 0.0F;  ///< Mean luminance of the albedo.
  LabelId label = 0;
  bool foliage = false;  ///< Many small, similar leaves.
};

/// All triangles and materials of a world, laid out for shading. Immutable.
class SurfaceTable {
 public:
  /// `world` must outlive the table.
  explicit SurfaceTable(const World& world) : SurfaceTable(world, world.mesh) {}
  /// Surfaces of `mesh` with the materials of `world`; both must outlive the table.
  SurfaceTable(const World& world, const SurfaceMesh& mesh);

  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(records_.size()); }
  [[nodiscard]] const SurfaceRecord& record(std::uint32_t triangle) const {
    return records_[triangle];
  }
  [[nodiscard]] const ShadingMaterial& material(const SurfaceRecord& record) const {
    return materials_[record.material];
  }
  /// Mean of the vertices' normals at barycentric coordinates (u, v), as Embree gives them; at most
  /// of unit length.
  [[nodiscard]] Eigen::Vector3f interpolated_normal(std::uint32_t triangle, float u,
                                                    float v) const {
    const auto& corners = mesh_->triangles[triangle];
    return (1.0F - u - v) * mesh_->normals[corners[0]] + u * mesh_->normals[corners[1]] +
           v * mesh_->normals[corners[2]];
  }

 private:
  const SurfaceMesh* mesh_;
  std::vector<SurfaceRecord> records_;
  std::vector<ShadingMaterial> materials_;
};

/// The surfaces of a fixed world, followed by those of things that move through it, if there are
/// any.
struct SurfaceView {
  const SurfaceTable& fixed;
  const SurfaceTable* moved = nullptr;

  SurfaceView(const SurfaceTable& fixed_surfaces,  // NOLINT(google-explicit-constructor)
              const SurfaceTable* moved_surfaces = nullptr)
      : fixed(fixed_surfaces), moved(moved_surfaces) {}

  [[nodiscard]] bool is_fixed(std::uint32_t triangle) const { return triangle < fixed.size(); }
  [[nodiscard]] const SurfaceRecord& record(std::uint32_t triangle) const {
    return is_fixed(triangle) ? fixed.record(triangle) : moved->record(triangle - fixed.size());
  }
  [[nodiscard]] const ShadingMaterial& material_of(std::uint32_t triangle) const {
    return is_fixed(triangle) ? fixed.material(record(triangle))
                              : moved->material(record(triangle));
  }
  [[nodiscard]] Eigen::Vector3f interpolated_normal(std::uint32_t triangle, float u,
                                                    float v) const {
    return is_fixed(triangle) ? fixed.interpolated_normal(triangle, u, v)
                              : moved->interpolated_normal(triangle - fixed.size(), u, v);
  }
};

/// Up to sixteen rays that hit something, and the data to shade and shadow the hit points.
struct SurfaceHits {
  RayPacket rays;        ///< Traced; directions have z = 1 in the camera frame, so tfar is depth.
  LaneMask active = 0;   ///< Lanes that belong to the image.
  LaneMask surface = 0;  ///< Active lanes that hit a surface; the others see the sky.
  Lanes3 right, down;    ///< Change of the direction per pixel to the right and down.
};

/// Geometry of the hit points, lane by lane. Lanes without a hit have finite, meaningless values.
struct SurfacePoints {
  Lanes3 view;          ///< Unit vector along the ray.
  Lanes distance_m;     ///< Distance along the ray.
  Lanes3 position;      ///< [m]
  Lanes3 plane_normal;  ///< Normal of the plane, towards the viewer.
  Lanes3 normal;        ///< Normal for shading, towards the viewer.
  std::array<const ShadingMaterial*, kLanes> material;
  Lanes u, v;              ///< Texture coordinates [m].
  Lanes major_u, major_v;  ///< Longer axis of a pixel's footprint [m].
  Lanes major_m, minor_m;  ///< Lengths of the axes of the footprint [m].
};

/// Computes positions, normals and texture footprints (exact ray differentials: Igehy, "Tracing Ray
/// Differentials", 1999) of hits.surface; nothing if that is empty.
void locate(const SurfaceView& surfaces, const SurfaceHits& hits, SurfacePoints& points);

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

/// Surfaces of things that move, where they are at one instant. Immutable.
class MovedSurfaces {
 public:
  /// `shapes`: a world whose objects are the things, each in its own frame. `poses[i]` is the pose
  /// of shapes.objects[i], to which all triangles belong. `shapes` must outlive this.
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
