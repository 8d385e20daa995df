#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "modules/core/stamp.hpp"
#include "modules/semantic_mapping/block_map.hpp"

namespace km {

/// A bit per voxel of a block: bit x + 8 y of word z.
using BlockBits = std::array<std::uint64_t, kBlockSide>;

/// Observed and occupied voxels of one block.
struct BlockSpace {
  Eigen::Vector3i position = Eigen::Vector3i::Zero();  ///< [blocks], as VoxelBlock::position
  BlockBits observed = {};  ///< Voxels with a distance. None: the block was removed.
  BlockBits inside = {};    ///< Those of them behind a surface or on it: distance <= 0.
};

/// Blocks whose space has changed, each once.
using SpaceChanges = std::vector<BlockSpace>;

/// Changes from one keyframe to the next.
struct SpaceUpdate {
  Stamp stamp = 0;
  double voxel_m = 0.1;     ///< Side of a voxel; constant.
  double camera_z_m = 0.0;  ///< Height of the camera in the odometry frame.
  bool is_first = false;    ///< The changes are the whole space: earlier updates no longer count.
  SpaceChanges changes;
};

}  // namespace km
