#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/semantic_mapping/block_map.hpp"

namespace km {

/// Triangles of a cell by the signs at its corners (Lorensen and Cline, "Marching Cubes", 1987).
///
/// Corner c of a cell lies at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge e runs along axis e / 4 from
/// corner first_corner_of_edge(e).
///
/// The table is derived, not listed. On each face of the cell, every run of negative corners is
/// separated from the rest, so that two diagonally opposite negative corners are not connected. The
/// cuts form loops, and loops are divided into fans of triangles. Two cells cut their common face
/// equally, so that the surface has no cracks.
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

/// The cells of one block with the values at their corners. The last corners are in the first layer
/// of the next blocks along each axis.
class BlockCells {
 public:
  /// Copies the values. Voxels that the map does not know count as not observed. The blocks must
  /// outlive this object.
  BlockCells(VoxelBlock& block, BlockMap& map);

  /// Cells of row (y, z), as bits by x, that the surface passes through: all corners are observed,
  /// and both signs occur.
  [[nodiscard]] unsigned crossed(int y, int z) const;

  /// Bit c: corner c of the cell is negative (see MarchingCubes).
  [[nodiscard]] unsigned negative_corners(int x, int y, int z) const;

  /// Signed distance at a voxel, coordinates in [0, 8].
  [[nodiscard]] float value(int x, int y, int z) const {
    return values_[row_of(y, z)][static_cast<std::size_t>(x)];
  }

  /// The block of a voxel with coordinates in [0, 8]. Precondition: the voxel was observed.
  [[nodiscard]] VoxelBlock& block_of(int x, int y, int z) const {
    return *blocks_[static_cast<std::size_t>((x >> 3) | (y >> 3) << 1 | (z >> 3) << 2)];
  }

  /// True if a voxel is known in one of the maps `finer`, or was (VoxelBlock::finer_rows). Their
  /// voxels are 2, 4, ... times smaller from the last one on. Precondition: the voxel was observed.
  [[nodiscard]] bool is_finer(int x, int y, int z, std::span<const BlockMap> finer) const;

  [[nodiscard]] double voxel_m() const { return voxel_m_; }

  /// False if no cell is crossed; a cheap test.
  [[nodiscard]] bool any() const { return any_; }

 private:
  static constexpr int kSide = kBlockSide + 1;

  [[nodiscard]] static std::size_t row_of(int y, int z) {
    return static_cast<std::size_t>(y + kSide * z);
  }
  void copy_row(int y, int z, const BlockMap& map);

  // Block and neighbours, at index x + 2 y + 4 z of their offset; null: no block.
  std::array<VoxelBlock*, 8> blocks_ = {};
  std::array<std::array<float, kSide>, kSide * kSide> values_;
  std::array<std::uint16_t, kSide* kSide> negative_ = {};  // bits by x
  std::array<std::uint16_t, kSide* kSide> observed_ = {};
  double voxel_m_;
  bool any_ = false;
};

}  // namespace km
