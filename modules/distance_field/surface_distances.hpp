#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/semantic_mapping/space_changes.hpp"

namespace km {

/// Squared distances of the voxels of a block [voxels^2], in the order of voxel_index().
using SquaredDistances = std::array<std::uint16_t, kBlockVoxels>;

/// A squared distance that is beyond the reach.
inline constexpr std::uint16_t kBeyondReach = 0xFFFF;

/// Surface voxels in a box of blocks.
struct SurfaceBox {
  Eigen::Vector3i low = Eigen::Vector3i::Zero();     ///< First block.
  Eigen::Vector3i blocks = Eigen::Vector3i::Zero();  ///< Number of blocks along each axis.
  std::vector<BlockBits> surface = {};               ///< One entry per block, x runs fastest.
};

/// A block whose distances are wanted.
struct DistanceTarget {
  Eigen::Vector3i position;  ///< [blocks]
  SquaredDistances* squared;
};

/// Computes the exact squared distances of the voxels of `targets` to the nearest surface voxel,
/// or kBeyondReach where it is more than `reach` voxels away; `reach` is at most 101.
///
/// One transform per axis, because the squared distance is a sum over the axes (Felzenszwalb and
/// Huttenlocher, "Distance Transforms of Sampled Functions", 2012, Sec. 2):
/// d(p) = min over q of f(q) + (p - q)^2. They find the minimum by the lower envelope of parabolas.
/// Here blocks of eight q are compared in the order of their distance from p, until the rest is
/// farther than the minimum found. So eight voxels along x share each instruction, and near surface
/// few q are compared.
void find_surface_distances(const SurfaceBox& box, int reach,
                            std::span<const DistanceTarget> targets);

}  // namespace km
