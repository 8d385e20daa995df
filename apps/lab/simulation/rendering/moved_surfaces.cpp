#include "apps/lab/simulation/rendering/moved_surfaces.hpp"

#include <stdexcept>
#include <string>

namespace km {
namespace {

// Moves the vertices of each object once, with all triangles that use them.
SurfaceMesh moved(const World& shapes, std::span<const SE3> poses) {
  if (poses.size() != shapes.objects.size())
    throw std::invalid_argument("moved surfaces: " + std::to_string(poses.size()) + " poses for " +
                                std::to_string(shapes.objects.size()) + " objects");
  SurfaceMesh mesh = shapes.mesh;
  std::vector<bool> is_moved(mesh.vertices.size(), false);
  std::size_t triangles = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const WorldObject& object = shapes.objects[i];
    const Eigen::Isometry3f T(poses[i].matrix().cast<float>());
    for (std::size_t t = object.first_triangle; t < object.end_triangle; ++t, ++triangles) {
      for (const std::uint32_t v : mesh.triangles.at(t)) {
        if (is_moved.at(v)) continue;
        is_moved[v] = true;
        mesh.vertices[v] = T * mesh.vertices[v];
        mesh.normals[v] = T.linear() * mesh.normals[v];
      }
    }
  }
  if (triangles != mesh.triangles.size())
    throw std::invalid_argument("moved surfaces: triangles without an object");
  return mesh;
}

}  // namespace

MovedSurfaces::MovedSurfaces(const World& shapes, std::span<const SE3> poses)
    : mesh_(moved(shapes, poses)), surfaces_(shapes, mesh_), tracer_(mesh_) {}

}  // namespace km
