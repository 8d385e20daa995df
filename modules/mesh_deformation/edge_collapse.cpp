#include "modules/mesh_deformation/edge_collapse.hpp"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

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

// Weight of the spread of a merged region, its area times the squared length of the edge, beside
// the quadric error, area times squared distance. On flat and gently curved surface it decides,
// at corners shape does: nodes are there for bending, and bending is everywhere.
constexpr double kSpread = 0.1;

std::uint32_t index_of(OpenMesh::VertexHandle vertex) {
  return static_cast<std::uint32_t>(vertex.idx());
}

// OpenMesh reports faces that it refuses on its error stream: quiet in this scope.
class QuietErrors {
 public:
  QuietErrors() { omerr().disable(); }
  ~QuietErrors() { omerr().enable(); }
  QuietErrors(const QuietErrors&) = delete;
  QuietErrors& operator=(const QuietErrors&) = delete;
};

// Quadric error plus spread; notes what was merged into what.
template <typename SurfaceT>
class SpreadQuadricsT : public OpenMesh::Decimater::ModQuadricT<SurfaceT> {
 public:
  DECIMATING_MODULE(SpreadQuadricsT, SurfaceT, SpreadQuadrics);
  using Quadrics = OpenMesh::Decimater::ModQuadricT<SurfaceT>;

  explicit SpreadQuadricsT(SurfaceT& mesh) : Quadrics(mesh) {}

  // `seen_by` and `merged_into` have an entry per vertex and outlive the decimation.
  void watch(const std::vector<SeenBy>& seen_by, KeyframeIndex window_keyframes,
             std::vector<double> area_m2, std::vector<std::uint32_t>& merged_into) {
    seen_by_ = &seen_by;
    window_keyframes_ = window_keyframes;
    area_m2_ = std::move(area_m2);
    merged_into_ = &merged_into;
  }

  float collapse_priority(const CollapseInfo& collapse) override {
    const SeenBy& removed = (*seen_by_)[index_of(collapse.v0)];
    const SeenBy& kept = (*seen_by_)[index_of(collapse.v1)];
    if (keyframe_gap(removed, kept) > window_keyframes_) return float(Base::ILLEGAL_COLLAPSE);
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
  KeyframeIndex window_keyframes_ = 0;
  std::vector<double> area_m2_;  // of the region merged into each vertex
  std::vector<std::uint32_t>* merged_into_ = nullptr;
};

// The triangles as a manifold. Vertex i is point i; corners of faces that would not fit are copies.
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

// A third of the faces around each vertex.
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

// Follows merged_into to its end, for every vertex. Shortens the paths on the way.
void resolve(std::vector<std::uint32_t>& merged_into) {
  for (std::uint32_t v = 0; v < merged_into.size(); ++v) {
    std::uint32_t end = v;
    while (merged_into[end] != end) end = merged_into[end];
    for (std::uint32_t step = v; merged_into[step] != end;)
      step = std::exchange(merged_into[step], end);
  }
}

void decimate(ManifoldSurface& manifold, std::size_t target, KeyframeIndex window_keyframes,
              std::vector<std::uint32_t>& merged_into) {
  const std::size_t count = vertices_with_faces(manifold.surface);
  if (count <= target) return;
  Decimater decimater(manifold.surface);
  OpenMesh::Decimater::ModHandleT<SpreadQuadricsT<Surface>> priority;
  decimater.add(priority);
  decimater.module(priority).watch(manifold.seen_by, window_keyframes,
                                   vertex_areas(manifold.surface), merged_into);
  decimater.initialize();
  decimater.decimate(count - target);
}

}  // namespace

CollapsedPoints collapse_edges(const TimedTriangles& triangles, std::size_t target,
                               KeyframeIndex window_keyframes) {
  ManifoldSurface manifold;
  fill(manifold, triangles);
  std::vector<std::uint32_t> merged_into(manifold.point_of_vertex.size());
  std::iota(merged_into.begin(), merged_into.end(), 0U);
  decimate(manifold, target, window_keyframes, merged_into);
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

}  // namespace km
