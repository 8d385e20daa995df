#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/semantic_mapping/block_map.hpp"
#include "modules/semantic_mapping/depth_view.hpp"

namespace km {

/// Blocks that a depth view shows surface in, or would, were there room.
struct NearBlocks {
  std::vector<VoxelBlock*> blocks;
  std::size_t allocated = 0;  ///< New ones among them.
  std::size_t refused = 0;    ///< Times that a block would have been new, but the map was full.
};

/// The blocks within kNearVoxels of the surface, by a subsample of the pixels about one voxel apart
/// at the view's greatest depth; new ones where the map has none, up to `max_blocks` in all. They
/// are marked with `frame`, a number that grows with every call, and new ones as seen by
/// `keyframe`.
[[nodiscard]] NearBlocks select_near_blocks(const DepthView& view, const SE3& T_odom_cam,
                                            double voxel_size_m, std::size_t max_blocks,
                                            std::uint64_t frame, KeyframeIndex keyframe,
                                            BlockMap& map);

}  // namespace km
