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

/// Triangles and their points. Each point has the keyframes that saw it.
struct TimedTriangles {
  std::vector<Eigen::Vector3d> points;  ///< [m]
  std::vector<SeenBy> seen_by;          ///< Keyframes that saw each point.
  std::vector<LabelledMesh::Face> faces;
};

/// Remaining points, and for each point the one into which it was merged.
struct CollapsedPoints {
  std::vector<std::uint32_t> kept;     ///< Indices of points; repeated if the surface is cut
                                       ///< open there.
  std::vector<std::uint32_t> kept_of;  ///< For each point an index into `kept`.
};

/// Decimates by half-edge collapses in OpenMesh until `target` points with faces remain, or no
/// collapse is possible. simplify() describes their order. Points whose keyframe_gap() exceeds
/// `max_gap_keyframes` are not merged. If more than two faces share an edge, the surface is cut
/// open there.
[[nodiscard]] CollapsedPoints collapse_edges(const TimedTriangles& triangles, std::size_t target,
                                             KeyframeIndex max_gap_keyframes);

/// Resolution of the simplified mesh, and the surfaces that it does not merge.
struct DecimationScale {
  double spacing_m = 0.5;                ///< Distance between neighbouring nodes.
  KeyframeIndex max_gap_keyframes = 50;  ///< Largest keyframe_gap() of surfaces that are merged.
};

/// The simplified mesh of a map: nodes, and the node of each vertex. The vertices of one node are
/// its region.
struct SimplifiedMesh {
  std::vector<MeshNode> nodes;
  std::vector<std::uint32_t> node_of_vertex;
};

/// The nodes of a map. For speed its vertices are first clustered on a grid of half the spacing.
/// Vertices of a cell are in one cluster if their keyframe_gap() to the first vertex of the cluster
/// is within the window. Then OpenMesh decimates the triangles between the clusters to as many
/// points as a triangular lattice with this spacing has on their area.
///
/// The order of collapses is that of quadric error (Garland and Heckbert, "Surface Simplification
/// Using Quadric Error Metrics", 1997) plus the spread of the merged region (area times squared
/// length of the edge). The spread distributes nodes over flat surface too, because the deformation
/// also bends flat surface. Nodes closer than half a spacing are merged.
///
/// Precondition: fault_of() finds no fault in the map. Linear in the vertices except for the
/// decimation of the clusters (n log n).
[[nodiscard]] SimplifiedMesh simplify(const MapMesh& map, const DecimationScale& scale);

/// Pairs of nodes a < b, ascending, whose regions share a face: the mesh edges of the simplified
/// mesh. Pairs whose keyframe_gap() exceeds `max_gap_keyframes` are excluded.
[[nodiscard]] std::vector<std::array<std::uint32_t, 2>> region_edges(
    const SimplifiedMesh& simplified, std::span<const LabelledMesh::Face> faces,
    KeyframeIndex max_gap_keyframes);

}  // namespace km
