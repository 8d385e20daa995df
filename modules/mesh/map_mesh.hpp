#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// The mesh of a robot's map, in the robot's odometry frame, as its mapper gives it and Local Mesh
/// Optimization takes it. `seen_by` is as long as mesh.vertices; `ids` too, or empty.
struct MapMesh {
  LabelledMesh mesh;

  /// First and last keyframe that saw each vertex.
  std::vector<std::array<KeyframeIndex, 2>> seen_by = {};

  /// Names the vertices from one update to the next; never given twice. Ascending, so that vertices
  /// that are in two updates are in the same order in both, and new ones come last.
  std::vector<std::uint64_t> ids = {};

  /// How well each vertex was measured, in steps of a factor of four of the weight behind it; as
  /// long as the vertices, or empty: all alike.
  std::vector<std::uint8_t> certainty = {};

  /// Side of the voxels the mesh was made from [m]; 0: unknown.
  double voxel_m = 0.0;
};

/// A vertex of a robot's map whose surface another visit mapped too, and better, and the vertex of
/// that visit which stands for it now. Ids are those of MapMesh.
struct SupersededVertex {
  std::uint64_t id = 0;
  std::uint64_t heir = 0;
};

/// What a map has twice: its mapper may drop the faces all of whose vertices are listed. Heirs have
/// a face that is none of these.
struct SupersededSurface {
  std::vector<SupersededVertex> vertices;  ///< By id, each once.
};

}  // namespace km
