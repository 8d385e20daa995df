#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace km {

/// Triangles of a cell by the signs at its corners (Lorensen and Cline, "Marching Cubes", 1987).
///
/// Corner c of a cell lies at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge e runs along axis e / 4 from
/// corner first_corner_of_edge(e). The table is derived, not listed: on each face of the cell,
/// every run of negative corners is cut off from the rest (so that of a face with two negative
/// corners across, these stay apart); the cuts join to loops, and loops are fanned into triangles.
/// Two cells cut their common face alike, so that the surface has no cracks.
class MarchingCubes {
 public:
  using Triangle = std::array<std::uint8_t, 3>;  ///< Edges, counter-clockwise from positive space.

  static constexpr int kEdges = 12;

  [[nodiscard]] static constexpr int axis_of_edge(int edge) { return edge / 4; }
  [[nodiscard]] static constexpr int first_corner_of_edge(int edge) {
    const int axis = edge / 4, low = edge & 1, high = edge >> 1 & 1;
    return low << (axis + 1) % 3 | high << (axis + 2) % 3;
  }

  MarchingCubes();

  /// The triangles of a cell; bit c of `negative`: the corner's value is below zero.
  [[nodiscard]] std::span<const Triangle> triangles(unsigned negative) const {
    return {triangles_.data() + first_[negative], triangles_.data() + first_[negative + 1]};
  }

 private:
  std::array<std::uint16_t, 257> first_ = {};
  std::vector<Triangle> triangles_;
};

}  // namespace km
