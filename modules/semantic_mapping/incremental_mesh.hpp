#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "modules/mesh/map_mesh.hpp"
#include "modules/semantic_mapping/block_map.hpp"
#include "modules/semantic_mapping/marching_cubes.hpp"
#include "modules/semantic_mapping/voxel_labels.hpp"

namespace km {

/// Result of IncrementalMesh::drop().
struct SurfaceDrop {
  std::size_t faces = 0;
  std::size_t vertices = 0;
};

/// The zero level of a map as a triangle mesh, updated block by block.
///
/// A vertex belongs to the grid edge it lies on, and that edge to the block of its lower voxel;
/// cells of all blocks around share it. A vertex exists while a face refers to it. Vertices at the
/// rim of final faces exist too, and still move with the blocks that are in the map.
class IncrementalMesh {
 public:
  /// Meshes the blocks that changed, and the blocks below them whose cells extend into them.
  /// Returns their number. Cells have a face where their voxels are known and the maps `finer` have
  /// no known voxels at the surface (see BlockCells::is_finer()).
  std::size_t update(BlockMap& map, std::span<const BlockMap> finer = {});

  /// Call before a block is erased because `keyframe` showed no surface in it. The next update()
  /// removes the faces of the block.
  void forget(VoxelBlock& block, BlockMap& map, KeyframeIndex keyframe);

  /// Call before blocks are erased whose mesh stays. Changed blocks are meshed once more. Faces of
  /// the blocks' cells, and of cells that extend into the blocks, become final. Returns the number
  /// of blocks that were meshed.
  std::size_t finalise(const std::vector<VoxelBlock*>& blocks, BlockMap& map,
                       std::span<const BlockMap> finer = {});

  /// Drops the final faces whose vertices are all listed, and then the listed vertices without
  /// other faces. The votes on labels of such a vertex are added to its replacement, unless that is
  /// the vertex itself. A vertex counts only if it and its replacement are final; unknown ids are
  /// ignored. n log n in the mesh.
  SurfaceDrop drop(const SupersededSurface& superseded);

  /// All faces and the vertices they use, with labels and colours as wanted. Positions are those of
  /// filter_surface(), which runs near vertices that are new, or have moved by a twentieth of the
  /// smallest voxels since they were last filtered. `maps`: all maps, from the finest on.
  [[nodiscard]] MapMesh snapshot(std::span<const BlockMap> maps, bool labelled,
                                 bool coloured = false);

  [[nodiscard]] std::size_t vertex_count() const { return vertices_.size() - free_.size(); }
  [[nodiscard]] std::size_t face_count() const { return faces_; }
  [[nodiscard]] std::size_t final_face_count() const { return final_faces_.size(); }

 private:
  using Face = LabelledMesh::Face;

  static constexpr std::uint64_t kRemoved = ~std::uint64_t{0};

  struct Vertex {
    Eigen::Vector3f position = Eigen::Vector3f::Zero();
    Eigen::Vector3f filtered = Eigen::Vector3f::Zero();
    /// Position at the last time that `filtered` was computed; NaN: never.
    Eigen::Vector3f filtered_at =
        Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
    std::uint32_t uses = 0;       // number of face corners that use it
    std::uint64_t id = kRemoved;  // id as in MapMesh::ids; kRemoved: the entry is free
    BlockMesh* owner = nullptr;   // mesh of the block of its edge; null: the block was erased
    VoxelLabels labels;
    ColorImage::Pixel color = {0, 0, 0};
    KeyframeIndex first = 0, last = 0;
    std::uint32_t computed = 0;  // number of the update in which position and labels were computed
    std::uint16_t edge = 0;      // index of the edge in the owner
    std::uint8_t certainty = 0, level = 0;  // see MapMesh
  };

  std::size_t mesh_blocks(const std::vector<VoxelBlock*>& blocks, BlockMap& map,
                          std::span<const BlockMap> finer);
  void finalise(VoxelBlock& block, BlockMap& map);
  void release(const Face& face);
  void release_faces(VoxelBlock& block);
  void mesh_block(VoxelBlock& block, BlockMap& map, std::span<const BlockMap> finer);
  std::uint32_t vertex_on(const BlockCells& cells, const Eigen::Vector3i& voxel, int axis,
                          const VoxelBlock& meshed);
  std::uint32_t new_vertex(KeyframeIndex keyframe);
  void compute(Vertex& vertex, const BlockCells& cells, const Eigen::Vector3i& voxel,
               int axis) const;
  [[nodiscard]] std::vector<std::uint32_t> final_replacements(
      const SupersededSurface& superseded) const;
  std::size_t remove_unused();
  void disown(VoxelBlock& block);

  MarchingCubes table_;
  std::vector<Vertex> vertices_;
  std::vector<std::uint32_t> free_;          // free indices in vertices_
  std::vector<std::uint32_t> maybe_unused_;  // vertices that lost their last face in this update
  std::vector<Face> final_faces_;
  std::vector<Face> forgotten_faces_;
  std::size_t faces_ = 0;
  std::uint64_t next_id_ = 0;
  std::uint32_t update_ = 0;
};

}  // namespace km
