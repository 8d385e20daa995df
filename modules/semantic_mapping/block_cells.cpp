#include "modules/semantic_mapping/block_cells.hpp"

#include <algorithm>

namespace km {

BlockCells::BlockCells(VoxelBlock& block, BlockMap& map, float min_weight) {
  blocks_[0] = &block;
  for (int i = 1; i < 8; ++i)
    blocks_[static_cast<std::size_t>(i)] =
        map.find(block.position + Eigen::Vector3i(i & 1, i >> 1 & 1, i >> 2 & 1));
  for (int z = 0; z < kSide; ++z)
    for (int y = 0; y < kSide; ++y) copy_row(y, z, min_weight);
  unsigned negative = 0, positive = 0;
  for (std::size_t row = 0; row < negative_.size(); ++row) {
    negative |= negative_[row] & observed_[row];
    positive |= static_cast<unsigned>(~negative_[row]) & observed_[row];
  }
  any_ = negative != 0 && positive != 0;
}

void BlockCells::copy_row(int y, int z, float min_weight) {
  const std::size_t row = row_of(y, z);
  const auto first = static_cast<std::size_t>((y >> 3) << 1 | (z >> 3) << 2);
  const std::size_t voxel = voxel_index(0, y & 7, z & 7);
  unsigned negative = 0, observed = 0;
  if (const VoxelBlock* block = blocks_[first]) {
    const float* distance = &block->distance[voxel];
    const float* weight = &block->weight[voxel];
    std::copy_n(distance, kBlockSide, values_[row].data());
    for (unsigned x = 0; x < kBlockSide; ++x) {
      negative |= distance[x] < 0.0F ? 1U << x : 0U;
      observed |= weight[x] > min_weight ? 1U << x : 0U;
    }
  }
  if (const VoxelBlock* block = blocks_[first + 1]) {
    values_[row][kBlockSide] = block->distance[voxel];
    negative |= block->distance[voxel] < 0.0F ? 1U << kBlockSide : 0U;
    observed |= block->weight[voxel] > min_weight ? 1U << kBlockSide : 0U;
  }
  negative_[row] = static_cast<std::uint16_t>(negative);
  observed_[row] = static_cast<std::uint16_t>(observed);
}

unsigned BlockCells::crossed(int y, int z) const {
  unsigned observed = ~0U, any = 0, all = ~0U;
  for (const std::size_t row :
       {row_of(y, z), row_of(y + 1, z), row_of(y, z + 1), row_of(y + 1, z + 1)}) {
    observed &= observed_[row];
    any |= negative_[row];
    all &= negative_[row];
  }
  return observed & (observed >> 1U) & (any | any >> 1U) & ~(all & all >> 1U) & 0xFFU;
}

unsigned BlockCells::negative_corners(int x, int y, int z) const {
  const auto pair = [&](std::size_t row) {
    return static_cast<unsigned>(negative_[row]) >> static_cast<unsigned>(x) & 3U;
  };
  return pair(row_of(y, z)) | pair(row_of(y + 1, z)) << 2U | pair(row_of(y, z + 1)) << 4U |
         pair(row_of(y + 1, z + 1)) << 6U;
}

}  // namespace km
