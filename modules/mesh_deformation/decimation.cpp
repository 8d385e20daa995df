#include "modules/mesh_deformation/decimation.hpp"

#include <algorithm>
#include <cmath>

#include "modules/mesh_deformation/edge_collapse.hpp"
#include "modules/mesh_deformation/node_grid.hpp"
#include "modules/mesh_deformation/vertex_clusters.hpp"

namespace km {
namespace {

constexpr double kClustersPerSpacing = 2.0;
constexpr double kNearSpacings = 0.5;  // nodes closer than this are one

// Joins vertices to nodes that are there already.
void join_near_nodes(SimplifiedMesh& simplified, const MapMesh& map, const NodeGrid& grid) {
  if (simplified.nodes.empty()) return;
  for (std::size_t v = 0; v < map.mesh.vertices.size(); ++v)
    if (simplified.node_of_vertex[v] == kNoIndex)
      simplified.node_of_vertex[v] =
          grid.nearest(map.mesh.vertices[v].cast<double>(), map.seen_by[v]);
}

double area_of(const TimedTriangles& triangles) {
  double twice = 0.0;
  for (const auto& [a, b, c] : triangles.faces) {
    const Eigen::Vector3d ab = triangles.points[b] - triangles.points[a];
    const Eigen::Vector3d ac = triangles.points[c] - triangles.points[a];
    twice += ab.cross(ac).norm();
  }
  return 0.5 * twice;
}

// Points of a triangular lattice with this spacing on that area.
std::size_t lattice_points(double area_m2, double spacing_m) {
  const double cell_m2 = 0.5 * std::sqrt(3.0) * spacing_m * spacing_m;
  return static_cast<std::size_t>(std::ceil(area_m2 / cell_m2));
}

// The node of every cluster; nodes are added where none is near.
std::vector<std::uint32_t> nodes_of_clusters(const VertexClusters& clusters,
                                             const CollapsedPoints& collapsed, NodeGrid& grid,
                                             std::vector<MeshNode>& nodes) {
  std::vector<std::uint32_t> node_of_kept;
  for (const std::uint32_t cluster : collapsed.kept) {
    const Eigen::Vector3d& position = clusters.triangles.points[cluster];
    const SeenBy& seen_by = clusters.triangles.seen_by[cluster];
    std::uint32_t node = grid.nearest(position, seen_by);
    if (node == kNoIndex) {
      node = static_cast<std::uint32_t>(nodes.size());
      nodes.push_back({position, seen_by, clusters.vertex[cluster]});
      grid.insert(nodes.back(), node);
    }
    node_of_kept.push_back(node);
  }
  std::vector<std::uint32_t> node_of_cluster;
  for (const std::uint32_t kept : collapsed.kept_of) node_of_cluster.push_back(node_of_kept[kept]);
  return node_of_cluster;
}

}  // namespace

void extend(SimplifiedMesh& simplified, const MapMesh& map, const DecimationScale& scale) {
  simplified.node_of_vertex.resize(map.mesh.vertices.size(), kNoIndex);
  NodeGrid grid(kNearSpacings * scale.spacing_m, scale.window_keyframes);
  for (std::uint32_t n = 0; n < simplified.nodes.size(); ++n) grid.insert(simplified.nodes[n], n);
  join_near_nodes(simplified, map, grid);

  const VertexClusters clusters =
      cluster_vertices(map, simplified.node_of_vertex, scale.spacing_m / kClustersPerSpacing,
                       scale.window_keyframes);
  if (clusters.vertex.empty()) return;
  const std::size_t target = lattice_points(area_of(clusters.triangles), scale.spacing_m);
  const CollapsedPoints collapsed =
      collapse_edges(clusters.triangles, target, scale.window_keyframes);
  const std::vector<std::uint32_t> node_of_cluster =
      nodes_of_clusters(clusters, collapsed, grid, simplified.nodes);
  for (std::size_t v = 0; v < map.mesh.vertices.size(); ++v)
    if (simplified.node_of_vertex[v] == kNoIndex)
      simplified.node_of_vertex[v] = node_of_cluster[clusters.cluster_of_vertex[v]];
}

std::vector<std::array<std::uint32_t, 2>> region_edges(const SimplifiedMesh& simplified,
                                                       std::span<const LabelledMesh::Face> faces,
                                                       KeyframeIndex window_keyframes) {
  std::vector<std::array<std::uint32_t, 2>> edges;
  const auto add = [&](std::uint32_t a, std::uint32_t b) {
    if (a == b) return;
    if (keyframe_gap(simplified.nodes[a].seen_by, simplified.nodes[b].seen_by) <= window_keyframes)
      edges.push_back({std::min(a, b), std::max(a, b)});
  };
  for (const auto& face : faces) {
    const std::uint32_t a = simplified.node_of_vertex[face[0]];
    const std::uint32_t b = simplified.node_of_vertex[face[1]];
    const std::uint32_t c = simplified.node_of_vertex[face[2]];
    add(a, b);
    add(b, c);
    add(c, a);
  }
  std::ranges::sort(edges);
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

}  // namespace km
