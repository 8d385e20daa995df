#include "modules/evaluation/mesh/sampled_surface.hpp"

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <numeric>
#include <random>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

namespace km {
namespace {

constexpr std::int64_t kMaxCells = 64;  // a box with more cells is not searched

// Calls `use` for the cells from `low` to `high` until it returns true; returns whether it did.
template <typename Use>
bool any_cell(const GridCell& low, const GridCell& high, const Use& use) {
  for (std::int64_t x = low[0]; x <= high[0]; ++x)
    for (std::int64_t y = low[1]; y <= high[1]; ++y)
      for (std::int64_t z = low[2]; z <= high[2]; ++z)
        if (use(GridCell{x, y, z})) return true;
  return false;
}

}  // namespace

NearbyCells::NearbyCells(double reach_m) : reach_m_(reach_m) {
  if (!(reach_m > 0.0) || !std::isfinite(reach_m))
    throw std::invalid_argument("a reach of " + std::to_string(reach_m) + " m");
}

GridCell NearbyCells::cell_of(const Eigen::Vector3f& point) const {
  return grid_cell(point.cast<double>(), reach_m_);
}

void NearbyCells::add(std::span<const Eigen::Vector3f> points) {
  const auto reach = static_cast<float>(reach_m_);
  std::unordered_set<GridCell, GridCellHash> done;
  for (const Eigen::Vector3f& point : points) {
    const GridCell cell = cell_of(point);
    bounds_.extend(point - Eigen::Vector3f::Constant(reach));
    bounds_.extend(point + Eigen::Vector3f::Constant(reach));
    if (!done.insert(cell).second) continue;
    const auto insert = [&](const GridCell& near) {
      cells_.insert(near);
      return false;
    };
    any_cell({cell[0] - 1, cell[1] - 1, cell[2] - 1}, {cell[0] + 1, cell[1] + 1, cell[2] + 1},
             insert);
  }
}

bool NearbyCells::contains(const Eigen::Vector3f& point) const {
  return bounds_.contains(point) && cells_.contains(cell_of(point));
}

bool NearbyCells::may_touch(const Eigen::AlignedBox3f& box) const {
  const Eigen::AlignedBox3f common = bounds_.intersection(box);
  if (common.isEmpty()) return false;
  const GridCell low = cell_of(common.min());
  const GridCell high = cell_of(common.max());
  const std::int64_t count =
      (high[0] - low[0] + 1) * (high[1] - low[1] + 1) * (high[2] - low[2] + 1);
  if (count > kMaxCells) return true;
  return any_cell(low, high, [&](const GridCell& cell) { return cells_.contains(cell); });
}

namespace {

struct Triangle {
  Eigen::Vector3f a, b, c;

  [[nodiscard]] double area() const {
    return 0.5 * (b - a).cast<double>().cross((c - a).cast<double>()).norm();
  }
  [[nodiscard]] Eigen::AlignedBox3f box() const {
    return Eigen::AlignedBox3f(a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c));
  }
};

Triangle triangle_of(const LabelledMesh& mesh, std::size_t face) {
  const auto [a, b, c] = mesh.faces[face];
  return {mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]};
}

float uniform(std::mt19937& random) {
  return static_cast<float>((static_cast<double>(random()) + 0.5) * 0x1p-32);
}

Eigen::Vector3f point_on(const Triangle& triangle, std::mt19937& random) {
  float u = uniform(random);
  float v = uniform(random);
  if (u + v > 1.0F) {  // the other half of the parallelogram
    u = 1.0F - u;
    v = 1.0F - v;
  }
  return triangle.a + u * (triangle.b - triangle.a) + v * (triangle.c - triangle.a);
}

}  // namespace

double surface_area(const LabelledMesh& mesh) {
  double sum = 0.0;
  for (std::size_t face = 0; face < mesh.faces.size(); ++face)
    sum += triangle_of(mesh, face).area();
  return sum;
}

SurfaceSamples sample_surface(const LabelledMesh& mesh, double per_m2, std::uint32_t seed,
                              const NearbyCells* only_near, std::size_t max_points) {
  std::mt19937 random(seed);
  SurfaceSamples samples;
  // Systematic sampling: point k lies on the face at which the running area passes (k + offset) /
  // per_m2. Faces much smaller than the area per point are sampled correctly on average.
  const auto offset = static_cast<double>(uniform(random));
  double reached = 0.0;
  for (std::size_t face = 0; face < mesh.faces.size(); ++face) {
    const Triangle triangle = triangle_of(mesh, face);
    reached += triangle.area() * per_m2;
    const auto upto = static_cast<std::size_t>(std::max(0.0, std::ceil(reached - offset)));
    const std::size_t count = upto - samples.total;
    samples.total = upto;
    if (count == 0 || (only_near != nullptr && !only_near->may_touch(triangle.box()))) continue;
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3f point = point_on(triangle, random);
      if (only_near != nullptr && !only_near->contains(point)) continue;
      if (++samples.near > max_points) continue;
      samples.points.push_back(point);
      samples.faces.push_back(static_cast<std::uint32_t>(face));
    }
  }
  return samples;
}

namespace {

// For each vertex, the first one at the same position.
std::vector<std::uint32_t> first_at_place(const LabelledMesh& mesh) {
  const auto place = [&](std::uint32_t i) {
    const Eigen::Vector3f& p = mesh.vertices[i];
    return std::tuple(p.x(), p.y(), p.z(), i);
  };
  std::vector<std::uint32_t> order(mesh.vertices.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return place(a) < place(b); });
  std::vector<std::uint32_t> first(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool again = i > 0 && mesh.vertices[order[i]] == mesh.vertices[order[i - 1]];
    first[order[i]] = again ? first[order[i - 1]] : order[i];
  }
  return first;
}

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}

// Boundary of a mesh: edges that only one face has. Vertices at the same position count as one.
class MeshBoundary {
 public:
  explicit MeshBoundary(const LabelledMesh& mesh);

  // The edge from corner k to corner k + 1 (of 3) of a face.
  [[nodiscard]] bool has_edge(std::size_t face, int k) const {
    return (faces_[face] >> k & 1U) != 0;
  }

  // Whether corner k of a face is on an edge of the boundary, possibly of another face.
  [[nodiscard]] bool has_corner(std::size_t face, int k) const {
    return (faces_[face] >> (3 + k) & 1U) != 0;
  }

 private:
  std::vector<std::uint8_t> faces_;  // three bits of edges, three of corners
};

MeshBoundary::MeshBoundary(const LabelledMesh& mesh) : faces_(mesh.faces.size(), 0) {
  const std::vector<std::uint32_t> vertex = first_at_place(mesh);
  const auto corner = [&](std::size_t face, int k) {
    return vertex[mesh.faces[face][static_cast<std::size_t>(k % 3)]];
  };
  std::vector<std::pair<std::uint64_t, std::size_t>> edges;  // with 3 face + k
  edges.reserve(3 * mesh.faces.size());
  for (std::size_t face = 0; face < mesh.faces.size(); ++face)
    for (int k = 0; k < 3; ++k)
      edges.emplace_back(edge_key(corner(face, k), corner(face, k + 1)),
                         3 * face + static_cast<std::size_t>(k));
  std::sort(edges.begin(), edges.end());
  std::vector<bool> on_rim(mesh.vertices.size(), false);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const auto& [key, place] = edges[i];
    if ((i > 0 && edges[i - 1].first == key) || (i + 1 < edges.size() && edges[i + 1].first == key))
      continue;
    faces_[place / 3] = static_cast<std::uint8_t>(faces_[place / 3] | 1U << place % 3);
    on_rim[key >> 32] = on_rim[key & 0xffffffffU] = true;
  }
  for (std::size_t face = 0; face < mesh.faces.size(); ++face)
    for (int k = 0; k < 3; ++k)
      if (on_rim[corner(face, k)])
        faces_[face] = static_cast<std::uint8_t>(faces_[face] | 1U << (3 + k));
}

constexpr std::size_t kNeighbours = 8;  // samples whose faces are measured

// Interface that nanoflann requires of a set of points.
struct Cloud {
  const std::vector<Eigen::Vector3f>& points;

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[i][static_cast<Eigen::Index>(axis)];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using Index = nanoflann::KDTreeSingleIndexAdaptor<
    nanoflann::L2_Simple_Adaptor<float, Cloud, float, std::uint32_t>, Cloud, 3, std::uint32_t>;

// The nearest samples closer than the square root of `limit2`.
class NearestWithin : public nanoflann::KNNResultSet<float, std::uint32_t> {
 public:
  explicit NearestWithin(float limit2) : KNNResultSet(kNeighbours), limit2_(limit2) {}
  [[nodiscard]] float worstDist() const { return std::min(KNNResultSet::worstDist(), limit2_); }

 private:
  float limit2_;
};

// The point of a triangle nearest to a given point.
struct TrianglePoint {
  double distance_m = 0.0;
  int edge = -1;    // The point is on the edge between corners `edge` and `edge` + 1 (of 3).
  int corner = -1;  // The point is on this corner. If both are -1, it is inside the face.
};

// Nearest point on the edge from corner `edge`, at a, to the next corner, at b.
TrianglePoint nearest_on_edge(const Eigen::Vector3d& point, const Eigen::Vector3d& a,
                              const Eigen::Vector3d& b, int edge) {
  const Eigen::Vector3d along = b - a;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((point - a).dot(along) / length2, 0.0, 1.0) : 0.0;
  const double distance_m = (point - a - t * along).norm();
  if (t == 0.0) return {distance_m, -1, edge};
  if (t == 1.0) return {distance_m, -1, (edge + 1) % 3};
  return {distance_m, edge, -1};
}

// Nearest point of the triangle a, b, c, which may be degenerate.
TrianglePoint nearest_on_triangle(const Eigen::Vector3d& point, const Eigen::Vector3d& a,
                                  const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const double length = normal.norm();
  if (length > 0.0) {
    const auto inside = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
      return (to - from).cross(point - from).dot(normal) >= 0.0;
    };
    if (inside(a, b) && inside(b, c) && inside(c, a))
      return {std::abs((point - a).dot(normal)) / length, -1, -1};
  }
  return std::min(
      {nearest_on_edge(point, a, b, 0), nearest_on_edge(point, b, c, 1),
       nearest_on_edge(point, c, a, 2)},
      [](const TrianglePoint& p, const TrianglePoint& q) { return p.distance_m < q.distance_m; });
}

}  // namespace

struct NearestSurface::Tree {
  Tree(const LabelledMesh& of, const SurfaceSamples& samples_of)
      : mesh(of), samples(samples_of), rim(of), cloud{samples_of.points}, index(3, cloud) {}

  [[nodiscard]] TrianglePoint on_face(const Eigen::Vector3f& point, std::uint32_t face) const {
    const auto corner = [&](std::size_t k) {
      return Eigen::Vector3d(mesh.vertices[mesh.faces[face][k]].cast<double>());
    };
    return nearest_on_triangle(point.cast<double>(), corner(0), corner(1), corner(2));
  }

  const LabelledMesh& mesh;
  const SurfaceSamples& samples;
  MeshBoundary rim;
  Cloud cloud;
  Index index;  // refers to cloud
};

NearestSurface::NearestSurface(const LabelledMesh& mesh, const SurfaceSamples& samples)
    : tree_(std::make_unique<Tree>(mesh, samples)) {}

NearestSurface::~NearestSurface() = default;
NearestSurface::NearestSurface(NearestSurface&&) noexcept = default;
NearestSurface& NearestSurface::operator=(NearestSurface&&) noexcept = default;

std::optional<NearestSample> NearestSurface::find(const Eigen::Vector3f& point,
                                                  double reach_m) const {
  if (tree_->samples.points.empty()) return std::nullopt;
  std::array<std::uint32_t, kNeighbours> found{};
  std::array<float, kNeighbours> distances2{};
  NearestWithin nearest(static_cast<float>(reach_m * reach_m));
  nearest.init(found.data(), distances2.data());
  tree_->index.findNeighbors(nearest, point.data(), {});
  if (nearest.size() == 0) return std::nullopt;
  NearestSample result;
  result.sample = found[0];
  result.distance_m = std::sqrt(distances2[0]);
  result.face = tree_->samples.faces[result.sample];
  TrianglePoint best = tree_->on_face(point, result.face);
  std::uint32_t last = result.face;
  for (std::size_t i = 1; i < nearest.size(); ++i) {
    const std::uint32_t face = tree_->samples.faces[found[i]];
    if (face == last) continue;
    last = face;
    const TrianglePoint other = tree_->on_face(point, face);
    if (other.distance_m >= best.distance_m) continue;
    result.face = face;
    best = other;
  }
  result.surface_m = std::min(result.distance_m, static_cast<float>(best.distance_m));
  result.past_boundary = (best.edge >= 0 && tree_->rim.has_edge(result.face, best.edge)) ||
                         (best.corner >= 0 && tree_->rim.has_corner(result.face, best.corner));
  return result;
}

}  // namespace km
