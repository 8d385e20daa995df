#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/distance_field/surface_distances.hpp"
#include "modules/semantic_mapping/block_map.hpp"
#include "modules/semantic_mapping/space_changes.hpp"

namespace km {

/// Euclidean signed distances to the nearest surface, on the voxels of the mapper's TSDF.
///
/// Surface voxels are voxels behind a surface with an observed voxel in front of it beside them
/// along an axis. Let d be the distance of a voxel to the nearest surface voxel [voxels]. The
/// signed distance is d - 1/2 in front of the surface and -(d + 1/2) behind it, because the surface
/// lies between two voxels. Distances are known in observed voxels only, but surface voxels count
/// from anywhere. In the map d is exact, so that the field differs from the true distance to the
/// surface of the TSDF by less than half a voxel along an axis.
///
/// Voxblox (Oleynikova et al., 2017) and FIESTA (Han et al., 2019) propagate distances from voxel
/// to voxel in a queue. Here whole blocks are computed exactly, see find_surface_distances().
///
/// Lazy: set() makes all blocks outdated, because a keyframe changes surface in nearly all blocks
/// in view. They are computed when a distance in them is asked for.
///
/// Memory: 1.2 kB per observed block of 8^3 voxels. Not thread-safe.
class DistanceField {
 public:
  /// Throws std::invalid_argument for more than kMaxReach voxels in `max_distance_m`.
  DistanceField(double max_distance_m, double voxel_size_m);

  static constexpr int kMaxReach = 100;  ///< [voxels] its square is below kBeyondReach

  /// Replaces what is known of these blocks.
  void set(const SpaceChanges& changes);

  /// Signed distance of a voxel [m]; nullopt if it was never observed.
  [[nodiscard]] std::optional<double> at_voxel(const Eigen::Vector3i& voxel);

  /// Centres of the observed voxels nearest to the height `z_m`, with their distances: a slice for
  /// viewers. In the order of their positions.
  struct SlicePoint {
    Eigen::Vector3f point;
    float distance_m;
  };
  [[nodiscard]] std::vector<SlicePoint> slice(double z_m);

  [[nodiscard]] std::size_t blocks() const { return blocks_.size(); }
  [[nodiscard]] double voxel_size_m() const { return voxel_m_; }
  [[nodiscard]] double max_distance_m() const { return max_m_; }

 private:
  struct Block {
    BlockBits observed = {}, inside = {};
    BlockBits surface = {};  // surface voxels, derived from the other two
    bool outdated = true;    // the distances are not valid
    SquaredDistances squared = {};
  };
  // Blocks from `low` to before `high`.
  struct Box {
    Eigen::Vector3i low, high;
  };

  [[nodiscard]] const Block* find(const Eigen::Vector3i& position) const;
  [[nodiscard]] BlockBits surface_of(const Eigen::Vector3i& position, const Block& block) const;
  void find_surface();
  [[nodiscard]] SurfaceBox surface_near(const Box& box) const;
  void compute(const std::vector<Eigen::Vector3i>& targets);
  [[nodiscard]] double signed_distance(const Block& block, int x, int y, int z) const;

  const double voxel_m_, max_m_;
  const int reach_;         // max_distance in voxels, rounded up
  const int reach_blocks_;  // and in blocks
  bool is_surface_outdated_ = false;
  std::unordered_map<Eigen::Vector3i, std::unique_ptr<Block>, BlockHash> blocks_;
};

}  // namespace km
