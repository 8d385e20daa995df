#pragma once

#include <Eigen/Core>
#include <set>
#include <unordered_map>

#include "modules/core/geometry.hpp"
#include "modules/semantic_mapping/block_fusion.hpp"
#include "modules/semantic_mapping/block_map.hpp"
#include "modules/semantic_mapping/depth_view.hpp"
#include "modules/semantic_mapping/semantic_mapping_config.hpp"
#include "modules/semantic_mapping/space_changes.hpp"

namespace km {

/// Follows what a mapper knows of the space in its window. A map has blocks only near surface. This
/// class also keeps which voxels of other blocks were seen free, within kFreeRange_m of the camera.
class SpaceTracker {
 public:
  static constexpr double kFreeRange_m = 5.0;

  /// `range_m`: range of depths; `window_m`: as in SemanticMappingConfig.
  SpaceTracker(double range_m, double window_m) : range_m_(range_m), window_m_(window_m) {}

  /// The block of the map has changed.
  void note(const Eigen::Vector3i& position) { changed_.insert(position); }

  /// The block was erased from the map because it is empty: its voxels are free.
  void note_empty(const Eigen::Vector3i& position, double way_m);

  /// The block was erased from the map because it has left the window.
  void note_left(const Eigen::Vector3i& position);

  /// Finds voxels outside the blocks of the map that a view shows as free. Free blocks that were
  /// not seen for window_m are removed. `way_m`: distance travelled by the camera.
  void see_free(const DepthView& view, const BlockFusion& fusion, const SE3& T_odom_cam,
                const BlockMap& map, double way_m);

  /// The changes since the last call, in the order of their positions.
  [[nodiscard]] SpaceChanges take(const BlockMap& map);

 private:
  struct FreeBlock {
    BlockBits observed = {};
    double last_seen_m = 0.0;
  };

  void add_free(const BlockFusion& fusion, double way_m);

  double range_m_, window_m_;
  std::unordered_map<Eigen::Vector3i, FreeBlock, BlockHash> free_;
  std::set<Eigen::Vector3i, BlockOrder> changed_;
  VoxelBlock scratch_;
};

}  // namespace km
