#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "modules/simulation/world/world.hpp"

namespace km {

/// What shading needs of one triangle, in one cache line.
struct alignas(64) SurfaceRecord {
  Eigen::Vector3f normal;      ///< Of the plane, unit length, outwards; zero without area.
  Eigen::Vector3f u_gradient;  ///< Texture coordinates [m] of a point p of the plane:
  Eigen::Vector3f v_gradient;  ///< gradient * p + offset.
  float u_offset = 0.0F;
  float v_offset = 0.0F;
  std::uint16_t material = 0;
  bool smooth = false;  ///< The vertices' normals differ: they are interpolated.
};

/// Materials with what does not depend on the point.
struct ShadingMaterial {
  const Texture* base = nullptr;
  const Texture* detail = nullptr;
  Texture::GrayTexels base_gray;
  Texture::GrayTexels detail_gray;
  Eigen::Vector3f tint = Eigen::Vector3f::Ones();
  float tint_luminance = 1.0F;
  float base_per_m = 1.0F;    ///< Tiles per metre.
  float detail_per_m = 1.0F;  ///< Tiles per metre.
  float specular = 0.0F;
  float glow = 0.0F;
  float transmission = 0.0F;    ///< Share of light that comes through from behind: leaves, cloth.
  float mean_luminance = 0.0F;  ///< Of the albedo.
  Eigen::Vector3f mean_color = Eigen::Vector3f::Zero();
  LabelId label = 0;
  bool foliage = false;  ///< Many small leaves, alike.
};

/// All triangles and materials of a world, laid out for shading. Immutable.
class SurfaceTable {
 public:
  /// `world` must outlive the table. Throws std::invalid_argument for an index out of range.
  explicit SurfaceTable(const World& world);

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

}  // namespace km
