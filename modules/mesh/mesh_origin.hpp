#pragma once

#include <array>
#include <map>
#include <span>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/mesh_cells.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Keyframes from which a mesh in `world` was seen, and their poses.
struct MeshOrigin {
  /// First and last keyframe that saw each vertex.
  std::vector<std::array<KeyframeIndex, 2>> seen_by;
  std::vector<SE3> T_world_kf;  ///< Poses with which the mesh was placed; all of these keyframes.
};

/// The median keyframe of the vertices in each cell of a grid. A vertex counts with the keyframe in
/// the middle between the first and the last one that saw it. Precondition: `seen_by` is as long as
/// the vertices, which are finite and nearer than 2^31 cells.
[[nodiscard]] std::map<MeshCells::Cell, KeyframeIndex> keyframes_of_cells(
    const LabelledMesh& mesh, std::span<const std::array<KeyframeIndex, 2>> seen_by, double cell_m);

}  // namespace km
