#include "modules/mesh_deformation/decimation.hpp"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "modules/mesh/grid_cell.hpp"

namespace km {
namespace {

struct Traits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  VertexAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge);
  FaceAttributes(OpenMesh::Attributes::Status);
};
using Surface = OpenMesh::TriMesh_ArrayKernelT<Traits>;
using Decimater = OpenMesh::Decimater::DecimaterT<Surface>;

// Weight of the spread (area of the merged region times squared length of the collapsed edge)
// relative to the quadric error (area times squared distance from planes). The spread determines
// the collapses on flat and gently curved surface, the quadric error those at corners.
constexpr double kSpread = 0.1;

std::uint32_t index_of(OpenMesh::VertexHandle vertex) {
  return static_cast<std::uint32_t>(vertex.idx());
}

// OpenMesh reports the faces that it refuses on its error stream. This class suppresses the reports
// in its scope.
class QuietErrors {
 public:
  QuietErrors() { omerr().disable(); }
  ~QuietErrors() { omerr().enable(); }
  QuietErrors(const QuietErrors&) = delete;
  QuietErrors& operator=(const QuietErrors&) = delete;
};

// Quadric error plus spread; records the merges.
template <typename SurfaceT>
class SpreadQuadricsT : public OpenMesh::Decimater::ModQuadricT<SurfaceT> {
 public:
  DECIMATING_MODULE(SpreadQuadricsT, SurfaceT, SpreadQuadrics);
  using Quadrics = OpenMesh::Decimater::ModQuadricT<SurfaceT>;

  explicit SpreadQuadricsT(SurfaceT& mesh) : Quadrics(mesh) {}

  // `seen_by` and `merged_into` have an entry per vertex and outlive the decimation.
  void watch(const std::vector<SeenBy>& seen_by, KeyframeIndex max_gap_keyframes,
             std::vector<double> area_m2, std::vector<std::uint32_t>& merged_into) {
    seen_by_ = &seen_by;
    max_gap_keyframes_ = max_gap_keyframes;
    area_m2_ = std::move(area_m2);
    merged_into_ = &merged_into;
  }

  float collapse_priority(const CollapseInfo& collapse) override {
    const SeenBy& removed = (*seen_by_)[index_of(collapse.v0)];
    const SeenBy& kept = (*seen_by_)[index_of(collapse.v1)];
    if (keyframe_gap(removed, kept) > max_gap_keyframes_) return float(Base::ILLEGAL_COLLAPSE);
    const double length2 = (collapse.p1 - collapse.p0).sqrnorm();
    const double area = area_m2_[index_of(collapse.v0)] + area_m2_[index_of(collapse.v1)];
    return Quadrics::collapse_priority(collapse) + static_cast<float>(kSpread * area * length2);
  }

  void postprocess_collapse(const CollapseInfo& collapse) override {
    Quadrics::postprocess_collapse(collapse);
    area_m2_[index_of(collapse.v1)] += area_m2_[index_of(collapse.v0)];
    (*merged_into_)[index_of(collapse.v0)] = index_of(collapse.v1);
  }

 private:
  const std::vector<SeenBy>* seen_by_ = nullptr;
  KeyframeIndex max_gap_keyframes_ = 0;
  std::vector<double> area_m2_;  // area merged into each vertex
  std::vector<std::uint32_t>* merged_into_ = nullptr;
};

// The triangles as a manifold. Vertex i is point i. A face that would violate the manifold gets
// copies of its corners as further vertices.
struct ManifoldSurface {
  Surface surface;
  std::vector<std::uint32_t> point_of_vertex;
  std::vector<SeenBy> seen_by;
};

void add_vertex(ManifoldSurface& manifold, const TimedTriangles& triangles, std::uint32_t point) {
  const Eigen::Vector3d& p = triangles.points[point];
  manifold.surface.add_vertex(Surface::Point(p.x(), p.y(), p.z()));
  manifold.point_of_vertex.push_back(point);
  manifold.seen_by.push_back(triangles.seen_by[point]);
}

void fill(ManifoldSurface& manifold, const TimedTriangles& triangles) {
  const QuietErrors quiet;
  Surface& surface = manifold.surface;
  for (std::uint32_t i = 0; i < triangles.points.size(); ++i) add_vertex(manifold, triangles, i);
  const auto handle = [](std::size_t i) { return OpenMesh::VertexHandle(static_cast<int>(i)); };
  for (const auto& [a, b, c] : triangles.faces) {
    if (surface.add_face(handle(a), handle(b), handle(c)).is_valid()) continue;
    const std::size_t first = surface.n_vertices();
    for (const std::uint32_t corner : {a, b, c}) add_vertex(manifold, triangles, corner);
    surface.add_face(handle(first), handle(first + 1), handle(first + 2));
  }
}

std::size_t vertices_with_faces(const Surface& surface) {
  return static_cast<std::size_t>(std::ranges::count_if(
      surface.vertices(), [&](OpenMesh::VertexHandle v) { return !surface.is_isolated(v); }));
}

// A third of the area of the faces around each vertex.
std::vector<double> vertex_areas(const Surface& surface) {
  std::vector<double> areas(surface.n_vertices(), 0.0);
  for (const auto face : surface.faces()) {
    std::array<OpenMesh::VertexHandle, 3> corners;
    std::size_t i = 0;
    for (const auto corner : surface.fv_range(face)) corners[i++] = corner;
    const Surface::Point& origin = surface.point(corners[0]);
    const double twice =
        ((surface.point(corners[1]) - origin) % (surface.point(corners[2]) - origin)).norm();
    for (const OpenMesh::VertexHandle corner : corners) areas[index_of(corner)] += twice / 6.0;
  }
  return areas;
}

// Follows merged_into to its end, for every vertex, and shortens the paths.
void resolve(std::vector<std::uint32_t>& merged_into) {
  for (std::uint32_t v = 0; v < merged_into.size(); ++v) {
    std::uint32_t end = v;
    while (merged_into[end] != end) end = merged_into[end];
    for (std::uint32_t step = v; merged_into[step] != end;)
      step = std::exchange(merged_into[step], end);
  }
}

void decimate(ManifoldSurface& manifold, std::size_t target, KeyframeIndex max_gap_keyframes,
              std::vector<std::uint32_t>& merged_into) {
  const std::size_t count = vertices_with_faces(manifold.surface);
  if (count <= target) return;
  Decimater decimater(manifold.surface);
  OpenMesh::Decimater::ModHandleT<SpreadQuadricsT<Surface>> priority;
  decimater.add(priority);
  decimater.module(priority).watch(manifold.seen_by, max_gap_keyframes,
                                   vertex_areas(manifold.surface), merged_into);
  decimater.initialize();
  decimater.decimate(count - target);
}

// Assigns vertices to clusters, one at a time.
class Clustering {
 public:
  Clustering(double width_m, KeyframeIndex max_gap_keyframes)
      : width_m_(width_m), max_gap_keyframes_(max_gap_keyframes) {}

  std::uint32_t cluster_of(const Eigen::Vector3d& point, const SeenBy& seen_by) {
    const auto next = static_cast<std::uint32_t>(seeds_.size());
    const auto [cell, is_new] = first_in_cell_.try_emplace(grid_cell(point, width_m_), next);
    if (!is_new) {
      std::uint32_t cluster = cell->second;
      while (keyframe_gap(seeds_[cluster].seen_by, seen_by) > max_gap_keyframes_) {
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
  KeyframeIndex max_gap_keyframes_;
  std::unordered_map<GridCell, std::uint32_t, GridCellHash> first_in_cell_;
  std::vector<Seed> seeds_;
};

// For every cluster, the vertex nearest to its centroid.
std::vector<std::uint32_t> central_vertices(const std::vector<Eigen::Vector3f>& vertices,
                                            const std::vector<std::uint32_t>& cluster_of_vertex,
                                            std::size_t count) {
  std::vector<Eigen::Vector4d> sums(count, Eigen::Vector4d::Zero());
  for (std::size_t v = 0; v < vertices.size(); ++v)
    sums[cluster_of_vertex[v]] += vertices[v].cast<double>().homogeneous();
  std::vector<std::uint32_t> best(count, kNoIndex);
  std::vector<double> best_distance2(count, std::numeric_limits<double>::infinity());
  for (std::uint32_t v = 0; v < vertices.size(); ++v) {
    const std::uint32_t c = cluster_of_vertex[v];
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
    std::ranges::rotate(face, std::ranges::min_element(face));  // lowest first, same orientation
    result.push_back(face);
  }
  std::ranges::sort(result);
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

constexpr double kClustersPerSpacing = 2.0;
constexpr double kNearSpacings = 0.5;  // nodes closer than this are merged

// Nodes by position, for searches within one radius while nodes are added.
class NodeGrid {
 public:
  // Nodes whose keyframe_gap() exceeds `max_gap_keyframes` are not near.
  NodeGrid(double radius_m, KeyframeIndex max_gap_keyframes)
      : radius_m_(radius_m), max_gap_keyframes_(max_gap_keyframes) {}

  void insert(const MeshNode& node, std::uint32_t index) {
    cells_[grid_cell(node.position, radius_m_)].emplace_back(node, index);
  }

  // Index of the nearest node within the radius that is near in time. At equal distance the lowest
  // index; kNoIndex if there is no such node.
  [[nodiscard]] std::uint32_t nearest(const Eigen::Vector3d& point, const SeenBy& seen_by) const {
    const auto [cx, cy, cz] = grid_cell(point, radius_m_);
    std::pair<double, std::uint32_t> best{radius_m_ * radius_m_, kNoIndex};
    for (int i = 0; i < 27; ++i) {
      const auto cell = cells_.find({cx + i % 3 - 1, cy + i / 3 % 3 - 1, cz + i / 9 - 1});
      if (cell == cells_.end()) continue;
      for (const auto& [node, index] : cell->second) {
        if (keyframe_gap(node.seen_by, seen_by) > max_gap_keyframes_) continue;
        best = std::min(best, std::pair{(node.position - point).squaredNorm(), index});
      }
    }
    return best.second;
  }

 private:
  double radius_m_;
  KeyframeIndex max_gap_keyframes_;
  std::unordered_map<GridCell, std::vector<std::pair<MeshNode, std::uint32_t>>, GridCellHash>
      cells_;
};

// Vertices of a mesh clustered by the cells of a grid, and the triangles between the clusters.
struct VertexClusters {
  TimedTriangles triangles;  // a point per cluster: the vertex nearest to its centroid
  std::vector<std::uint32_t> cluster_of_vertex;
};

// Faces with corners in three clusters remain, each once.
VertexClusters cluster_vertices(const MapMesh& map, double width_m,
                                KeyframeIndex max_gap_keyframes) {
  const auto& vertices = map.mesh.vertices;
  VertexClusters clusters;
  Clustering clustering(width_m, max_gap_keyframes);
  for (std::size_t v = 0; v < vertices.size(); ++v)
    clusters.cluster_of_vertex.push_back(
        clustering.cluster_of(vertices[v].cast<double>(), map.seen_by[v]));
  for (const std::uint32_t v :
       central_vertices(vertices, clusters.cluster_of_vertex, clustering.count())) {
    clusters.triangles.points.push_back(vertices[v].cast<double>());
    clusters.triangles.seen_by.push_back(map.seen_by[v]);
  }
  clusters.triangles.faces = cluster_faces(map.mesh.faces, clusters.cluster_of_vertex);
  return clusters;
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

// Number of points of a triangular lattice with this spacing on that area.
std::size_t lattice_points(double area_m2, double spacing_m) {
  const double cell_m2 = 0.5 * std::sqrt(3.0) * spacing_m * spacing_m;
  return static_cast<std::size_t>(std::ceil(area_m2 / cell_m2));
}

// The node of every cluster; a node is added if none is near.
std::vector<std::uint32_t> nodes_of_clusters(const TimedTriangles& clusters,
                                             const CollapsedPoints& collapsed,
                                             const DecimationScale& scale,
                                             std::vector<MeshNode>& nodes) {
  NodeGrid grid(kNearSpacings * scale.spacing_m, scale.max_gap_keyframes);
  std::vector<std::uint32_t> node_of_kept;
  for (const std::uint32_t cluster : collapsed.kept) {
    const MeshNode candidate{clusters.points[cluster], clusters.seen_by[cluster]};
    std::uint32_t node = grid.nearest(candidate.position, candidate.seen_by);
    if (node == kNoIndex) {
      node = static_cast<std::uint32_t>(nodes.size());
      nodes.push_back(candidate);
      grid.insert(candidate, node);
    }
    node_of_kept.push_back(node);
  }
  std::vector<std::uint32_t> node_of_cluster;
  for (const std::uint32_t kept : collapsed.kept_of) node_of_cluster.push_back(node_of_kept[kept]);
  return node_of_cluster;
}

}  // namespace

CollapsedPoints collapse_edges(const TimedTriangles& triangles, std::size_t target,
                               KeyframeIndex max_gap_keyframes) {
  ManifoldSurface manifold;
  fill(manifold, triangles);
  std::vector<std::uint32_t> merged_into(manifold.point_of_vertex.size());
  std::iota(merged_into.begin(), merged_into.end(), 0U);
  decimate(manifold, target, max_gap_keyframes, merged_into);
  resolve(merged_into);

  CollapsedPoints collapsed;
  std::vector<std::uint32_t> place(merged_into.size(), kNoIndex);
  for (std::uint32_t v = 0; v < merged_into.size(); ++v) {
    if (merged_into[v] != v) continue;
    place[v] = static_cast<std::uint32_t>(collapsed.kept.size());
    collapsed.kept.push_back(manifold.point_of_vertex[v]);
  }
  for (std::size_t p = 0; p < triangles.points.size(); ++p)
    collapsed.kept_of.push_back(place[merged_into[p]]);
  return collapsed;
}

SimplifiedMesh simplify(const MapMesh& map, const DecimationScale& scale) {
  SimplifiedMesh simplified;
  const VertexClusters clusters =
      cluster_vertices(map, scale.spacing_m / kClustersPerSpacing, scale.max_gap_keyframes);
  if (clusters.cluster_of_vertex.empty()) return simplified;
  const std::size_t target = lattice_points(area_of(clusters.triangles), scale.spacing_m);
  const CollapsedPoints collapsed =
      collapse_edges(clusters.triangles, target, scale.max_gap_keyframes);
  const std::vector<std::uint32_t> node_of_cluster =
      nodes_of_clusters(clusters.triangles, collapsed, scale, simplified.nodes);
  for (const std::uint32_t cluster : clusters.cluster_of_vertex)
    simplified.node_of_vertex.push_back(node_of_cluster[cluster]);
  return simplified;
}

std::vector<std::array<std::uint32_t, 2>> region_edges(const SimplifiedMesh& simplified,
                                                       std::span<const LabelledMesh::Face> faces,
                                                       KeyframeIndex max_gap_keyframes) {
  std::vector<std::array<std::uint32_t, 2>> edges;
  const auto add = [&](std::uint32_t a, std::uint32_t b) {
    if (a == b) return;
    if (keyframe_gap(simplified.nodes[a].seen_by, simplified.nodes[b].seen_by) <= max_gap_keyframes)
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
