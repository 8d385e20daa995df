#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/mesh/coarse_view.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// The mesh of a robot's map, in the robot's odometry frame, from the mapper to Local Mesh
/// Optimization. `seen_by` is as long as mesh.vertices. `ids` has this length too, or is empty.
struct MapMesh {
  LabelledMesh mesh;

  /// First and last keyframe that saw each vertex; as long as mesh.vertices.
  std::vector<std::array<KeyframeIndex, 2>> seen_by = {};

  /// Identifies the vertices from one update to the next; never reused. Ascending: vertices that
  /// are in two updates have the same order in both, and new ones come last.
  std::vector<std::uint64_t> ids = {};

  /// Certainty of each vertex: log4 of its weight, rounded down, plus a constant. As long as the
  /// vertices, or empty if all are equal.
  std::vector<std::uint8_t> certainty = {};

  /// Each vertex is from voxels of side 2^level * voxel_m. As long as the vertices, or empty if all
  /// levels are 0.
  std::vector<std::uint8_t> levels = {};

  /// How far the camera saw, in order of time; none: unknown.
  std::vector<std::shared_ptr<const CoarseView>> views = {};

  /// Side of the smallest voxels the mesh was made from [m]; 0: unknown.
  double voxel_m = 0.0;
};

/// The reason why `map` cannot be the mesh of a map (a string literal), or null. Reasons are lists
/// of other lengths, faces with vertices that do not exist, ids that do not ascend, and vertices
/// that are not finite or beyond 10,000 km.
[[nodiscard]] const char* fault_of(const MapMesh& map);

/// A vertex of a robot's map whose surface other visits have mapped better, and the vertex of one
/// of these visits that replaces it. The vertex itself if its surface is gone. Ids are those of
/// MapMesh.
struct SupersededVertex {
  std::uint64_t id = 0;
  std::uint64_t replacement = 0;
};

/// Surface that a map need not contain: its mapper may drop the faces whose vertices are all
/// listed. Each other vertex that replaces one belongs to a face that is not dropped.
struct SupersededSurface {
  std::vector<SupersededVertex> vertices;  ///< Ascending ids, each once.
};

}  // namespace km
