#pragma once

#include <Eigen/Core>
#include <unordered_map>
#include <vector>

#include "modules/semantic_mapping/block_map.hpp"
#include "modules/semantic_mapping/space_changes.hpp"

namespace km {

/// Slices of the Euclidean signed distances to the nearest surface, on the voxels of the mapper's
/// TSDF.
///
/// Surface voxels are voxels behind a surface with an observed voxel in front of it beside them
/// along an axis. Let d be the distance of a voxel to the nearest surface voxel [voxels]. The
/// signed distance is d - 1/2 in front of the surface and -(d + 1/2) behind it, because the surface
/// lies between two voxels. d is exact, so that the result differs from the true distance to the
/// surface of the TSDF by less than half a voxel along an axis.
///
/// Memory: 0.2 kB per observed block of 8^3 voxels. Not thread-safe.
class DistanceField {
 public:
  DistanceField(double max_distance_m, double voxel_size_m)
      : max_m_(max_distance_m), voxel_m_(voxel_size_m) {}

  /// Replaces what is known of these blocks.
  void set(const SpaceChanges& changes);

  /// Centres of the observed voxels nearest to the height `z_m`, with their distances. In the order
  /// of their blocks.
  struct SlicePoint {
    Eigen::Vector3f point;
    float distance_m;  ///< At most max_distance_m() on both sides.
  };
  [[nodiscard]] std::vector<SlicePoint> slice(double z_m) const;

  [[nodiscard]] double max_distance_m() const { return max_m_; }

 private:
  [[nodiscard]] BlockBits surface_of(const BlockSpace& block) const;

  double max_m_, voxel_m_;
  std::unordered_map<Eigen::Vector3i, BlockSpace, BlockHash> blocks_;  // by position
};

}  // namespace km
