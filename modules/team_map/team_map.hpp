#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh/mesh_chunks.hpp"
#include "modules/mesh/team_mesh.hpp"
#include "modules/team_map/surface_fusion.hpp"

namespace km {

/// The map of a team: the fused surface of all robots whose chunks have one frame. Each robot has
/// one of its own, of its own chunks as it has sent them and of those that it has received. Two
/// robots with the same chunks and the same voxels have the same mesh, bit by bit, in whatever
/// order the chunks came (on processors with the same arithmetic).
///
/// Chunks replace each other; only boxes that they touch are fused again. Not thread-safe.
class TeamMap {
 public:
  /// Boxes near surface; surface in others is left out. A bound for misbehaving peers.
  static constexpr std::size_t kMaxBoxes = std::size_t{1} << 19U;

  explicit TeamMap(double voxel_m) : fusion_(voxel_m) {}

  /// Takes a chunk of any robot, as TeamMesh::add().
  ChunkVerdict add(MeshChunk chunk);

  /// Fuses the boxes that have changed.
  void update();

  /// The fused mesh of the last update(), without colours, and with labels if any robot
  /// has sent labels. Vertices and faces are ordered by boxes.
  [[nodiscard]] LabelledMesh mesh() const;

  /// Robot in whose odometry frame the mesh is: the anchor of most chunks, the lowest id if several
  /// have as many. Chunks with another anchor are left out.
  [[nodiscard]] RobotId anchor() const { return anchor_; }

  /// Number of boxes that update() has to fuse.
  [[nodiscard]] std::size_t waiting() const { return changed_.size(); }

 private:
  using Box = std::array<std::int32_t, 3>;
  enum class Presence { kAdded, kRemoved };

  void choose_anchor();
  void note(const MeshChunk& chunk, Presence presence);
  [[nodiscard]] std::vector<RobotSurface> surfaces_near(const Box& box) const;

  SurfaceFusion fusion_;
  TeamMesh chunks_;
  RobotId anchor_ = 0;
  std::map<RobotId, std::size_t> chunks_with_anchor_;
  std::map<Box, std::set<MeshChunkKey>> chunks_near_;  // those that may change the box
  std::set<Box> changed_;
  std::map<Box, FusedBox> boxes_;  // none empty
};

/// A mesh as the only one of a TeamMap: with fewer faces if the voxels are larger than its own.
[[nodiscard]] LabelledMesh resampled(const LabelledMesh& mesh, double voxel_m);

}  // namespace km
