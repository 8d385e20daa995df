#include "modules/evaluation/mesh/nearest_surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <nanoflann.hpp>

#include "modules/evaluation/mesh/mesh_rim.hpp"

namespace km {
namespace {

constexpr std::size_t kNeighbours = 8;  // samples whose faces are measured to

// What nanoflann asks of a set of points.
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

// The nearest few within a limit, for nanoflann; of points at equal distance the first.
class Nearest {
 public:
  using DistanceType = float;
  using IndexType = std::uint32_t;

  explicit Nearest(float limit2) : limit2_(limit2) {}

  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] bool full() const { return count_ == kNeighbours; }
  [[nodiscard]] float worstDist() const { return full() ? found_.back().first : limit2_; }
  [[nodiscard]] const std::pair<float, std::uint32_t>& operator[](std::size_t i) const {
    return found_[i];
  }

  bool addPoint(float distance2, std::uint32_t index) {
    const std::pair entry(distance2, index);
    if (distance2 > limit2_ || (full() && found_.back() < entry)) return true;
    std::size_t place = full() ? kNeighbours - 1 : count_++;
    for (; place > 0 && entry < found_[place - 1]; --place) found_[place] = found_[place - 1];
    found_[place] = entry;
    return true;
  }

 private:
  std::array<std::pair<float, std::uint32_t>, kNeighbours> found_{};
  std::size_t count_ = 0;
  float limit2_;
};

using Index = nanoflann::KDTreeSingleIndexAdaptor<
    nanoflann::L2_Simple_Adaptor<float, Cloud, float, std::uint32_t>, Cloud, 3, std::uint32_t>;

// On the edge from corner `edge`, at a, to the next, at b.
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

}  // namespace

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
  MeshRim rim;
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
  Nearest nearest(static_cast<float>(reach_m * reach_m));
  tree_->index.findNeighbors(nearest, point.data(), nanoflann::SearchParams());
  if (nearest.size() == 0) return std::nullopt;
  NearestSample result;
  result.sample = nearest[0].second;
  result.distance_m = std::sqrt(nearest[0].first);
  result.face = tree_->samples.faces[nearest[0].second];
  TrianglePoint best = tree_->on_face(point, result.face);
  std::uint32_t last = result.face;
  for (std::size_t i = 1; i < nearest.size(); ++i) {
    const std::uint32_t face = tree_->samples.faces[nearest[i].second];
    if (face == last) continue;
    last = face;
    const TrianglePoint other = tree_->on_face(point, face);
    if (other.distance_m >= best.distance_m) continue;
    result.face = face;
    best = other;
  }
  result.surface_m = std::min(result.distance_m, static_cast<float>(best.distance_m));
  result.past_rim = (best.edge >= 0 && tree_->rim.has_edge(result.face, best.edge)) ||
                    (best.corner >= 0 && tree_->rim.has_corner(result.face, best.corner));
  return result;
}

}  // namespace km
