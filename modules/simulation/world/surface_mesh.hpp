#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace km {

/// Triangles of the whole world, frame `world`: metres, z up. No vertex is shared between triangles
/// that meet at an edge which shall look sharp. Leaves are single triangles, seen from both sides.
struct SurfaceMesh {
  std::vector<Eigen::Vector3f> vertices;                ///< [m]
  std::vector<Eigen::Vector3f> normals;                 ///< Per vertex, unit length.
  std::vector<Eigen::Vector2f> uv;                      ///< Per vertex, along the surface [m].
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< Counter-clockwise seen from outside.
  std::vector<std::uint16_t> materials;  ///< Per triangle: index into World::materials.

  /// Adds the triangles of `other`. Throws std::length_error beyond 2^32 vertices.
  void append(const SurfaceMesh& other);
};

}  // namespace km
