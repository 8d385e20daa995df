#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Where a mesh ends: edges that only one face has. Vertices at the same place count as one.
class MeshRim {
 public:
  explicit MeshRim(const LabelledMesh& mesh);

  /// The edge from corner k to corner k + 1 (of 3) of a face.
  [[nodiscard]] bool has_edge(std::size_t face, int k) const {
    return (faces_[face] >> k & 1U) != 0;
  }

  /// Whether corner k of a face lies on an edge of the rim, be it another face's.
  [[nodiscard]] bool has_corner(std::size_t face, int k) const {
    return (faces_[face] >> (3 + k) & 1U) != 0;
  }

 private:
  std::vector<std::uint8_t> faces_;  // three bits of edges, three of corners
};

}  // namespace km
