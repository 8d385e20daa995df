#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// A directed edge of a face.
using DirectedEdge = std::pair<std::uint32_t, std::uint32_t>;

/// Directed edges of faces without the opposite edge of another face: the rim of the surface. A
/// closed surface has none.
inline std::vector<DirectedEdge> rim_of(const LabelledMesh& mesh) {
  std::map<DirectedEdge, int> balance;
  for (const auto& face : mesh.faces)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = face[i], b = face[(i + 1) % 3];
      if (a < b) {
        ++balance[{a, b}];
      } else {
        --balance[{b, a}];
      }
    }
  std::vector<DirectedEdge> rim;
  for (const auto& [edge, count] : balance)
    if (count != 0) rim.push_back(edge);
  return rim;
}

/// Volume enclosed by a closed surface; positive if its faces are counter-clockwise seen from
/// outside [m^3].
inline double volume_of(const LabelledMesh& mesh) {
  double volume = 0.0;
  for (const auto& face : mesh.faces) {
    const Eigen::Vector3d a = mesh.vertices[face[0]].cast<double>();
    const Eigen::Vector3d b = mesh.vertices[face[1]].cast<double>();
    const Eigen::Vector3d c = mesh.vertices[face[2]].cast<double>();
    volume += a.dot(b.cross(c)) / 6.0;
  }
  return volume;
}

}  // namespace km
