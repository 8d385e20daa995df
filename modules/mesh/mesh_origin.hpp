#pragma once

#include <map>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/mesh_cells.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Keyframes from which a mesh in `world` was seen, and their poses.
struct MeshOrigin {
  /// Keyframe in the middle between the first and the last one that saw each vertex.
  std::vector<KeyframeIndex> keyframe_of_vertex;
  std::vector<SE3> T_world_kf;  ///< Poses with which the mesh was placed; all of these keyframes.
};

/// The median keyframe of the vertices in each cell of a grid. Precondition: `keyframe_of_vertex`
/// is as long as the vertices, which are finite and nearer than 2^31 cells.
[[nodiscard]] std::map<MeshCells::Cell, KeyframeIndex> keyframes_of_cells(
    const LabelledMesh& mesh, const std::vector<KeyframeIndex>& keyframe_of_vertex, double cell_m);

}  // namespace km
