#include "modules/simulation/rendering/surface_table.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <stdexcept>
#include <string>

#include "modules/simulation/rendering/luminance.hpp"

namespace km {
namespace {

void require_indices(const World& world) {
  const SurfaceMesh& mesh = world.mesh;
  const auto fail = [&world](const std::string& what) {
    throw std::invalid_argument("world " + world.name + ": " + what);
  };
  if (mesh.normals.size() != mesh.vertices.size() || mesh.uv.size() != mesh.vertices.size())
    fail("normals or texture coordinates do not match the vertices");
  if (mesh.materials.size() != mesh.triangles.size())
    fail("there is not one material per triangle");
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle)
      if (vertex >= mesh.vertices.size()) fail("no vertex " + std::to_string(vertex));
  for (const std::uint16_t material : mesh.materials)
    if (material >= world.materials.size()) fail("no material " + std::to_string(material));
  for (const Material& material : world.materials)
    if (material.base >= world.textures.size() || material.detail >= world.textures.size())
      fail("no texture " + std::to_string(std::max(material.base, material.detail)));
}

ShadingMaterial shading_material(const World& world, const Material& material) {
  ShadingMaterial result;
  result.base = &world.textures[material.base];
  result.detail = &world.textures[material.detail];
  result.base_gray = result.base->gray_texels();
  result.detail_gray = result.detail->gray_texels();
  result.tint = material.tint;
  result.tint_luminance = luminance_of(material.tint);
  result.base_per_m = 1.0F / material.base_period_m;
  result.detail_per_m = 1.0F / material.detail_period_m;
  result.specular = material.specular;
  result.glow = material.glow;
  if (material.label == SurfaceClass::kVegetation) result.transmission = 0.5F;
  if (material.label == SurfaceClass::kTent) result.transmission = 0.15F;
  if (material.label == SurfaceClass::kCurtain) result.transmission = 0.3F;
  result.mean_color = material.tint.cwiseProduct(result.base->color({0.5F, 0.5F}, 1.0F));
  result.mean_luminance = luminance_of(result.mean_color);
  result.label = static_cast<LabelId>(material.label);
  result.foliage = material.label == SurfaceClass::kVegetation;
  return result;
}

SurfaceRecord surface_record(const SurfaceMesh& mesh, std::size_t index) {
  const auto& triangle = mesh.triangles[index];
  const Eigen::Vector3f& p0 = mesh.vertices[triangle[0]];
  const Eigen::Vector3f edge1 = mesh.vertices[triangle[1]] - p0;
  const Eigen::Vector3f edge2 = mesh.vertices[triangle[2]] - p0;
  SurfaceRecord record;
  record.material = mesh.materials[index];
  record.normal = edge1.cross(edge2).normalized();
  for (const std::uint32_t vertex : triangle)
    record.smooth = record.smooth || mesh.normals[vertex].dot(record.normal) < 0.9999F;

  // The gradient within the plane: its products with the edges are the differences of uv.
  const Eigen::Vector2f uv0 = mesh.uv[triangle[0]];
  Eigen::Matrix3f frame;
  frame << edge1.transpose(), edge2.transpose(), record.normal.transpose();
  Eigen::Matrix<float, 3, 2> difference = Eigen::Matrix<float, 3, 2>::Zero();
  difference.row(0) = mesh.uv[triangle[1]] - uv0;
  difference.row(1) = mesh.uv[triangle[2]] - uv0;
  Eigen::Matrix<float, 3, 2> gradient = frame.inverse() * difference;
  if (!gradient.allFinite()) gradient.setZero();
  record.u_gradient = gradient.col(0);
  record.v_gradient = gradient.col(1);
  record.u_offset = uv0.x() - record.u_gradient.dot(p0);
  record.v_offset = uv0.y() - record.v_gradient.dot(p0);
  return record;
}

}  // namespace

SurfaceTable::SurfaceTable(const World& world) : mesh_(&world.mesh) {
  require_indices(world);
  materials_.reserve(world.materials.size());
  for (const Material& material : world.materials)
    materials_.push_back(shading_material(world, material));
  records_.reserve(mesh_->triangles.size());
  for (std::size_t i = 0; i < mesh_->triangles.size(); ++i)
    records_.push_back(surface_record(*mesh_, i));
}

}  // namespace km
