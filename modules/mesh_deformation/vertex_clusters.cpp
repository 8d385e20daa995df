#include "modules/mesh_deformation/vertex_clusters.hpp"

#include <algorithm>
#include <limits>
#include <unordered_map>

#include "modules/mesh_deformation/node_grid.hpp"

namespace km {
namespace {

// Gives vertices to clusters, one at a time.
class Clustering {
 public:
  Clustering(double width_m, KeyframeIndex window_keyframes)
      : width_m_(width_m), window_keyframes_(window_keyframes) {}

  std::uint32_t cluster_of(const Eigen::Vector3d& point, const SeenBy& seen_by) {
    const auto next = static_cast<std::uint32_t>(seeds_.size());
    const auto [cell, is_new] = first_in_cell_.try_emplace(grid_cell(point, width_m_), next);
    if (!is_new) {
      std::uint32_t cluster = cell->second;
      while (keyframe_gap(seeds_[cluster].seen_by, seen_by) > window_keyframes_) {
        if (seeds_[cluster].next_in_cell == kNoIndex) {
          seeds_[cluster].next_in_cell = next;
          cluster = next;
          break;
        }
        cluster = seeds_[cluster].next_in_cell;
      }
      if (cluster != next) return cluster;
    }
    seeds_.push_back({seen_by, kNoIndex});
    return next;
  }

  [[nodiscard]] std::size_t count() const { return seeds_.size(); }

 private:
  struct Seed {
    SeenBy seen_by;
    std::uint32_t next_in_cell;
  };
  double width_m_;
  KeyframeIndex window_keyframes_;
  std::unordered_map<GridCell, std::uint32_t, GridCellHash> first_in_cell_;
  std::vector<Seed> seeds_;
};

// The vertex of every cluster that is nearest to the cluster's centroid.
std::vector<std::uint32_t> central_vertices(const std::vector<Eigen::Vector3f>& vertices,
                                            const std::vector<std::uint32_t>& cluster_of_vertex,
                                            std::size_t count) {
  std::vector<Eigen::Vector4d> sums(count, Eigen::Vector4d::Zero());
  for (std::size_t v = 0; v < vertices.size(); ++v)
    if (cluster_of_vertex[v] != kNoIndex)
      sums[cluster_of_vertex[v]] += vertices[v].cast<double>().homogeneous();
  std::vector<std::uint32_t> best(count, kNoIndex);
  std::vector<double> best_distance2(count, std::numeric_limits<double>::infinity());
  for (std::uint32_t v = 0; v < vertices.size(); ++v) {
    const std::uint32_t c = cluster_of_vertex[v];
    if (c == kNoIndex) continue;
    const double distance2 = (vertices[v].cast<double>() - sums[c].hnormalized()).squaredNorm();
    if (distance2 >= best_distance2[c]) continue;
    best_distance2[c] = distance2;
    best[c] = v;
  }
  return best;
}

std::vector<LabelledMesh::Face> cluster_faces(const std::vector<LabelledMesh::Face>& faces,
                                              const std::vector<std::uint32_t>& cluster_of_vertex) {
  std::vector<LabelledMesh::Face> result;
  for (const auto& corners : faces) {
    LabelledMesh::Face face = {};
    for (std::size_t i = 0; i < 3; ++i) face[i] = cluster_of_vertex[corners[i]];
    if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) continue;
    if (std::ranges::find(face, kNoIndex) != face.end()) continue;
    std::ranges::rotate(face, std::ranges::min_element(face));  // lowest first, same orientation
    result.push_back(face);
  }
  std::ranges::sort(result);
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

}  // namespace

VertexClusters cluster_vertices(const MapMesh& map, std::span<const std::uint32_t> node_of_vertex,
                                double width_m, KeyframeIndex window_keyframes) {
  const auto& vertices = map.mesh.vertices;
  VertexClusters clusters;
  clusters.cluster_of_vertex.assign(vertices.size(), kNoIndex);
  Clustering clustering(width_m, window_keyframes);
  for (std::size_t v = 0; v < vertices.size(); ++v)
    if (node_of_vertex[v] == kNoIndex)
      clusters.cluster_of_vertex[v] =
          clustering.cluster_of(vertices[v].cast<double>(), map.seen_by[v]);
  clusters.vertex = central_vertices(vertices, clusters.cluster_of_vertex, clustering.count());
  for (const std::uint32_t v : clusters.vertex) {
    clusters.triangles.points.push_back(vertices[v].cast<double>());
    clusters.triangles.seen_by.push_back(map.seen_by[v]);
  }
  clusters.triangles.faces = cluster_faces(map.mesh.faces, clusters.cluster_of_vertex);
  return clusters;
}

}  // namespace km
