#include "modules/semantic_mapping/space_tracker.hpp"

#include <algorithm>
#include <utility>

namespace km {
namespace {

// The blocks between the corners of a view's frustum, up to a depth.
std::pair<Eigen::Vector3i, Eigen::Vector3i> blocks_in(const DepthView& view, const SE3& T_odom_cam,
                                                      double depth_m, double block_m) {
  Eigen::Vector3d low = T_odom_cam.translation(), high = low;
  for (const float u : {0.0F, static_cast<float>(view.width)})
    for (const float v : {0.0F, static_cast<float>(view.height)}) {
      const Eigen::Vector3f bearing((u - view.cx) / view.fx, (v - view.cy) / view.fy, 1.0F);
      const Eigen::Vector3d corner = T_odom_cam * (depth_m * bearing.cast<double>());
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
  const auto block = [block_m](const Eigen::Vector3d& point) {
    return Eigen::Vector3i(
        (point / block_m).array().floor().cwiseMax(-1e6).cwiseMin(1e6).cast<int>());
  };
  return {block(low), block(high)};
}

BlockSpace space_of(const BlockMap& map, const VoxelBlock& block) {
  BlockSpace space{.position = block.position};
  for (std::size_t k = 0; k < kBlockVoxels; ++k) {
    const std::uint64_t bit = std::uint64_t{1} << (k % 64);
    if (!map.knows(block, k)) continue;
    space.observed[k / 64] |= bit;
    if (block.distance[k] <= 0.0F) space.inside[k / 64] |= bit;
  }
  return space;
}

}  // namespace

void SpaceTracker::note_empty(const Eigen::Vector3i& position, double way_m) {
  FreeBlock block{.last_seen_m = way_m};
  block.observed.fill(~std::uint64_t{0});
  free_.insert_or_assign(position, block);
  note(position);
}

void SpaceTracker::note_left(const Eigen::Vector3i& position) {
  free_.erase(position);
  note(position);
}

void SpaceTracker::see_free(const DepthView& view, const BlockFusion& fusion, const SE3& T_odom_cam,
                            const BlockMap& map, double way_m) {
  const double depth_m = std::min(kFreeRange_m, range_m_);
  const auto [low, high] = blocks_in(view, T_odom_cam, depth_m, kBlockSide * map.voxel_m());
  for (int z = low.z(); z <= high.z(); ++z)
    for (int y = low.y(); y <= high.y(); ++y)
      for (int x = low.x(); x <= high.x(); ++x) {
        scratch_.position = {x, y, z};
        if (BlockMap::in_reach(scratch_.position) && map.find(scratch_.position) == nullptr)
          add_free(fusion, way_m);
      }
  for (auto entry = free_.begin(); entry != free_.end();) {
    if (way_m - entry->second.last_seen_m > window_m_) {
      changed_.insert(entry->first);
      entry = free_.erase(entry);
    } else {
      ++entry;
    }
  }
}

void SpaceTracker::add_free(const BlockFusion& fusion, double way_m) {
  const BlockFusion::Relation relation = fusion.relation_to(scratch_);
  if (relation == BlockFusion::Relation::kNotSeen) return;
  BlockBits seen = {};
  if (relation == BlockFusion::Relation::kFree) {
    seen.fill(~std::uint64_t{0});
  } else {
    scratch_.weight.fill(0.0F);
    fusion.fuse(scratch_);
    for (std::size_t k = 0; k < kBlockVoxels; ++k)
      if (scratch_.weight[k] > 0.0F && scratch_.distance[k] > 0.0F)
        seen[k / 64] |= std::uint64_t{1} << (k % 64);
    if (seen == BlockBits{}) return;
  }
  FreeBlock& block = free_[scratch_.position];
  block.last_seen_m = way_m;
  for (std::size_t z = 0; z < seen.size(); ++z) {
    if ((seen[z] & ~block.observed[z]) == 0) continue;
    block.observed[z] |= seen[z];
    changed_.insert(scratch_.position);
  }
}

SpaceChanges SpaceTracker::take(const BlockMap& map) {
  SpaceChanges changes;
  for (const Eigen::Vector3i& position : std::exchange(changed_, {})) {
    const auto free = free_.find(position);
    BlockSpace space{.position = position};
    if (const VoxelBlock* block = map.find(position)) space = space_of(map, *block);
    // A voxel that was seen free before the block had surface stays known.
    if (free != free_.end())
      for (std::size_t z = 0; z < space.observed.size(); ++z)
        space.observed[z] |= free->second.observed[z];
    changes.push_back(space);
  }
  return changes;
}

}  // namespace km
