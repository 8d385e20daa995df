#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include "modules/core/camera/color_image.hpp"
#include "modules/core/ids.hpp"
#include "modules/semantic_mapping/voxel_labels.hpp"

namespace km {

/// Side of a block in voxels.
inline constexpr int kBlockSide = 8;
inline constexpr std::size_t kBlockRows = 64;  ///< Rows along x.
inline constexpr std::size_t kBlockVoxels = 512;

/// Bound on the distance to a surface [voxels] within which voxels vote on labels and count as seen
/// by a keyframe. Blocks are allocated up to this distance. The vertices of the mesh are between
/// two such voxels.
inline constexpr float kNearVoxels = 2.0F;

/// Index of a voxel in a block's arrays; x, y, z in [0, 8).
inline constexpr std::size_t voxel_index(int x, int y, int z) {
  return static_cast<std::size_t>(x + kBlockSide * (y + kBlockSide * z));
}

/// The mesh of the cells of one block: cell (x, y, z) has its lowest corner at voxel (x, y, z).
struct BlockMesh {
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;

  BlockMesh() { vertex_of_edge.fill(kNone); }

  /// Vertex on the edge from a voxel to the next one along an axis, at 3 * voxel_index + axis.
  std::array<std::uint32_t, 3 * kBlockVoxels> vertex_of_edge;
  std::vector<std::array<std::uint32_t, 3>> faces;
  std::vector<std::uint16_t> cell_of_face;  ///< voxel_index of the cell's lowest corner.
};

/// Colour of a voxel, and the quality of the view that it is from; 0: no colour.
struct VoxelColor {
  ColorImage::Pixel color = {0, 0, 0};
  std::uint8_t quality = 0;
};

/// Conditions under which an observed voxel counts as known: at least this number of views, and a
/// sum of weights above this one.
struct KnownFrom {
  std::uint8_t views = 1;
  float weight = 0.0F;
};

/// 8 x 8 x 8 voxels of the map. Voxel (x, y, z) samples the point
/// (8 position + (x, y, z)) * voxel size of the odometry frame.
struct VoxelBlock {
  Eigen::Vector3i position = Eigen::Vector3i::Zero();  ///< [blocks]

  /// Signed distance along the optical axis [m], positive in free space; undefined for a voxel that
  /// was never observed (weight 0).
  std::array<float, kBlockVoxels> distance = {};
  std::array<float, kBlockVoxels> weight = {};

  /// Number of views that observed each voxel, at most 255.
  std::array<std::uint8_t, kBlockVoxels> views = {};

  /// Null until a labelled frame showed the block.
  std::unique_ptr<std::array<VoxelLabels, kBlockVoxels>> labels;

  /// Null until a frame with colours showed the block.
  std::unique_ptr<std::array<VoxelColor, kBlockVoxels>> colors;

  /// Null until a face of the mesh has a vertex on one of the block's edges.
  std::unique_ptr<BlockMesh> mesh;

  /// Bit x of row y + 8 z: blocks of smaller voxels that have left the window knew the voxel.
  std::array<std::uint8_t, kBlockRows> finer_rows = {};

  /// Bit x of row y + 8 z: the voxel was seen near a surface since the block was last meshed.
  std::array<std::uint8_t, kBlockRows> near_rows = {};

  std::uint64_t selected_in = 0;    ///< Last frame for which select_near_blocks() chose the block.
  KeyframeIndex last_seen = 0;      ///< Last keyframe that saw surface in the block.
  double last_seen_m = 0.0;         ///< Distance travelled by the camera at the last selection [m].
  KeyframeIndex changed_since = 0;  ///< First keyframe of the changes not yet meshed.
  bool changed = false;             ///< Changed since the block was last meshed.
};

/// Hash of the positions of blocks.
struct BlockHash {
  std::size_t operator()(const Eigen::Vector3i& position) const noexcept;
};

/// The blocks of a map with voxels of one size, hashed by their position. References to blocks stay
/// valid until they are erased. The order of blocks() depends only on the sequence of calls.
class BlockMap {
 public:
  BlockMap(double voxel_m, const KnownFrom& known) : voxel_m_(voxel_m), known_(known) {}

  [[nodiscard]] double voxel_m() const { return voxel_m_; }

  /// The voxel counts as known.
  [[nodiscard]] bool knows(const VoxelBlock& block, std::size_t voxel) const {
    return block.views[voxel] >= known_.views && block.weight[voxel] > known_.weight;
  }

  /// Positions are representable from -kReach to kReach - 1 along every axis.
  static constexpr int kReach = 1 << 20;

  [[nodiscard]] static bool in_reach(const Eigen::Vector3i& position) {
    return (position.array() >= -kReach).all() && (position.array() < kReach).all();
  }

  /// The block at `position`, or nullptr.
  [[nodiscard]] VoxelBlock* find(const Eigen::Vector3i& position) {
    return const_cast<VoxelBlock*>(std::as_const(*this).find(position));
  }
  [[nodiscard]] const VoxelBlock* find(const Eigen::Vector3i& position) const;

  /// A new, empty block. Preconditions: no block at `position`, in_reach(position).
  VoxelBlock& insert(const Eigen::Vector3i& position);

  /// Precondition: there is a block at `position`.
  void erase(const Eigen::Vector3i& position);

  [[nodiscard]] std::size_t size() const { return blocks_.size(); }
  [[nodiscard]] const std::vector<std::unique_ptr<VoxelBlock>>& blocks() const { return blocks_; }

 private:
  double voxel_m_;
  KnownFrom known_;
  std::vector<std::unique_ptr<VoxelBlock>> blocks_;
  std::unordered_map<Eigen::Vector3i, std::size_t, BlockHash> index_;  // index in blocks_
};

}  // namespace km
