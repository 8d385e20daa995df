#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "modules/mesh/map_mesh.hpp"
#include "modules/mesh_deformation/edge_collapse.hpp"

namespace km {

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

}  // namespace km
