#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/semantic_mapping/block_map.hpp"
#include "modules/semantic_mapping/depth_view.hpp"
#include "modules/semantic_mapping/semantic_mapping_config.hpp"

namespace km {

/// Blocks in which a depth view shows surface, including those for which the map has no room.
struct NearBlocks {
  std::vector<VoxelBlock*> blocks;
  std::size_t refused = 0;  ///< Requests for a block beyond `max_blocks` or BlockMap::kReach.
};

/// Depths above `above_m` and up to `to_m`.
struct DepthBand {
  double above_m = 0.0;
  double to_m = 0.0;
};

/// The blocks within kNearVoxels of the surface at depths of the band, found by a subsample of the
/// pixels about one voxel apart at the greatest depth. Missing blocks are allocated, up to
/// `max_blocks` in this map. All are marked with `frame`, a number that grows with every call, and
/// new ones also as seen by `keyframe`.
[[nodiscard]] NearBlocks select_near_blocks(const DepthView& view, const SE3& T_odom_cam,
                                            const DepthBand& band, std::size_t max_blocks,
                                            std::uint64_t frame, KeyframeIndex keyframe,
                                            BlockMap& map);

/// Factor on the colours of a view that makes it as bright as the map, 0.5 to 2. It is the ratio of
/// the sums over a sample of pixels whose voxels have colours; 1 for too few of them.
[[nodiscard]] float exposure_gain(const DepthView& view, const SE3& T_odom_cam,
                                  std::span<const BlockMap> maps);

/// Fuses one depth view into blocks. fuse() changes only its block, so it may run on several blocks
/// at once.
///
/// A voxel at depth z that projects to a pixel of depth d has the signed distance s = d - z along
/// the optical axis. If s > -truncation, the voxel's distance becomes the weighted mean of its
/// former value and min(s, truncation) (Curless and Levoy, 1996). The weight is kDepthSigma_m^2 /
/// sigma(d)^2 (see SemanticMappingConfig). From one voxel behind the surface to the truncation the
/// weight falls linearly to zero, because a voxel farther behind may belong to another surface.
class BlockFusion {
 public:
  /// For blocks with voxels of side `voxel_m`. Colours of the view are multiplied by `gain`.
  BlockFusion(const SemanticMappingConfig& config, double voxel_m, const DepthView& view,
              const SE3& T_odom_cam, KeyframeIndex keyframe, float gain = 1.0F);

  /// Relation of a view and a block.
  enum class Relation {
    kNotSeen,  ///< Outside the image, behind every surface, or without depth.
    kMixed,    ///< Depends on the voxel.
    kFree,     ///< In front of every surface by more than the truncation.
  };
  [[nodiscard]] Relation relation_to(const VoxelBlock& block) const;

  /// Updates every voxel of the block. Its labels are updated if the block has an array of labels
  /// and the view has labels.
  void fuse(VoxelBlock& block) const;

  /// fuse() for a block with Relation::kFree, faster.
  void fuse_free(VoxelBlock& block) const;

  /// True if no voxel of the block is near a surface: every observed one is at least three quarters
  /// of the truncation in front of it.
  [[nodiscard]] bool is_empty(const VoxelBlock& block) const;

 private:
  struct Row;

  [[nodiscard]] Eigen::Vector3f corner_of(const VoxelBlock& block) const;
  void project(const Eigen::Vector3f& start, Row& row) const;
  void update(Row& row, std::size_t first, VoxelBlock& block) const;
  void vote(const Row& row, VoxelLabels* labels) const;
  void tint(const Row& row, VoxelColor* colors) const;
  [[nodiscard]] float weight_of(float depth) const;

  const DepthView& view_;
  KeyframeIndex keyframe_;
  Eigen::Matrix3d M_;       // maps a point in the odometry frame: (u z, v z, z) = M p + K t
  Eigen::Vector3d offset_;  // K t
  Eigen::Matrix3f step_;    // columns: M times one voxel along x, y, z
  double block_m_;
  float truncation_, voxel_, near_, closest_, max_weight_;
  float gain_;
  float variance_, quadratic_variance_;  // kDepthSigma_m^2, depth_sigma_per_m^2
};

}  // namespace km
