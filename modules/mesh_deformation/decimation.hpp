#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh/map_mesh.hpp"
#include "modules/mesh_deformation/mesh_node.hpp"

namespace km {

/// Triangles between points that were each seen for some time.
struct TimedTriangles {
  std::vector<Eigen::Vector3d> points;  ///< [m]
  std::vector<SeenBy> seen_by;          ///< Of each point.
  std::vector<LabelledMesh::Face> faces;
};

/// Points that are left, and the one that each point was merged into.
struct CollapsedPoints {
  std::vector<std::uint32_t> kept;     ///< Index of a point; twice where surfaces cross there.
  std::vector<std::uint32_t> kept_of;  ///< For each point an index into `kept`.
};

/// Decimates by half-edge collapses in OpenMesh until `target` points are left that belong to
/// faces, or no collapse is possible. See extend() for their order; points seen further apart in
/// time than the window are not merged. Faces may meet in any way: where more than two share an
/// edge, the surface is cut open.
[[nodiscard]] CollapsedPoints collapse_edges(const TimedTriangles& triangles, std::size_t target,
                                             KeyframeIndex window_keyframes);

/// Vertices of a mesh put together by cells of a grid, and the triangles between them.
struct VertexClusters {
  TimedTriangles triangles;           ///< A point per cluster: that of its vertex.
  std::vector<std::uint32_t> vertex;  ///< Of each cluster the vertex nearest to its centroid.
  std::vector<std::uint32_t> cluster_of_vertex;  ///< kNoIndex for vertices that were left out.
};

/// Clusters those vertices of `map` whose `node_of_vertex` is kNoIndex, in cells of `width_m`.
/// Vertices of a cell are in one cluster if they were seen within the window of its first. Faces
/// whose corners lie in three clusters remain, each once. Linear.
[[nodiscard]] VertexClusters cluster_vertices(const MapMesh& map,
                                              std::span<const std::uint32_t> node_of_vertex,
                                              double width_m, KeyframeIndex window_keyframes);

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
