#pragma once

#include "modules/semantic_mapping/incremental_mesh.hpp"

namespace km {

inline constexpr double kVoxel_m = 0.1;

inline Eigen::Vector3d point_of(const VoxelBlock& block, int x, int y, int z) {
  return kVoxel_m * (kBlockSide * block.position + Eigen::Vector3i(x, y, z)).cast<double>();
}

/// Sets all voxels of a block from a distance function, as observed.
template <typename Distance>
void fill(VoxelBlock& block, const Distance& distance) {
  for (int z = 0; z < kBlockSide; ++z)
    for (int y = 0; y < kBlockSide; ++y)
      for (int x = 0; x < kBlockSide; ++x) {
        const std::size_t voxel = voxel_index(x, y, z);
        block.distance[voxel] = static_cast<float>(distance(point_of(block, x, y, z)));
        block.weight[voxel] = 1.0F;
      }
  block.changed = true;
}

/// Blocks from -n to n - 1 along each axis: many borders run through what is in the middle.
template <typename Distance>
void fill(BlockMap& map, int n, const Distance& distance) {
  for (int z = -n; z < n; ++z)
    for (int y = -n; y < n; ++y)
      for (int x = -n; x < n; ++x) fill(map.insert({x, y, z}), distance);
}

inline IncrementalMesh new_mesh() {
  return {kVoxel_m, LabelModel{}, 0.0, 0.0};
}

}  // namespace km
