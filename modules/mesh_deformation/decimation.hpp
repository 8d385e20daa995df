#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/mesh/map_mesh.hpp"
#include "modules/mesh_deformation/mesh_node.hpp"

namespace km {

/// How coarse the simplified mesh is, and what it keeps apart.
struct DecimationScale {
  double spacing_m = 0.5;               ///< Between neighbouring nodes.
  KeyframeIndex window_keyframes = 50;  ///< Surfaces seen further apart in time are not joined.
};

/// The mesh of a map, subsampled: nodes, and the node that stands for each vertex. The vertices of
/// one node are its region.
struct SimplifiedMesh {
  std::vector<MeshNode> nodes;
  std::vector<std::uint32_t> node_of_vertex;  ///< kNoIndex: not yet given to one.
};

/// Gives every vertex of `map` that has no node in `simplified` to one. Vertices within half a
/// spacing of a node join it; the rest is simplified to new nodes, appended to the old: first
/// vertices are clustered on a grid of half the spacing (what makes it fast), then the mesh
/// of the clusters is decimated by OpenMesh to the number of nodes that its area asks for. The
/// order of collapses is that of quadric error (Garland and Heckbert, "Surface Simplification Using
/// Quadric Error Metrics", 1997) plus the spread of the merged region, which distributes the
/// nodes over flat surface: it bends too. Nodes that come closer than half a spacing are one.
///
/// `simplified.node_of_vertex` is first filled up with kNoIndex to the length of map.mesh.vertices.
/// Precondition: map passed check_map_mesh(). Linear in the new vertices but for the decimation of
/// the clusters (n log n).
void extend(SimplifiedMesh& simplified, const MapMesh& map, const DecimationScale& scale);

/// Pairs of nodes a < b, ascending, whose regions share a face: the mesh edges of the simplified
/// mesh. Pairs seen further apart in time than the window are left out.
[[nodiscard]] std::vector<std::array<std::uint32_t, 2>> region_edges(
    const SimplifiedMesh& simplified, std::span<const LabelledMesh::Face> faces,
    KeyframeIndex window_keyframes);

}  // namespace km
