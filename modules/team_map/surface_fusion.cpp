#include "modules/team_map/surface_fusion.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace km {
namespace {

// Vertices keep this distance [voxels] from the ends of their edges, so that no two coincide.
constexpr float kMargin = 1e-3F;

// Distances [voxels] that differ by less are equal.
constexpr float kSame_voxels = 1e-4F;

// The nearest point of a triangle (Ericson, "Real-Time Collision Detection", 2005, sec. 5.1.5).
Eigen::Vector3f nearest_point(const std::array<Eigen::Vector3f, 3>& corners,
                              const Eigen::Vector3f& p) {
  const auto& [a, b, c] = corners;
  const Eigen::Vector3f ab = b - a, ac = c - a, ap = p - a;
  const float d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0.0F && d2 <= 0.0F) return a;
  const Eigen::Vector3f bp = p - b;
  const float d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0.0F && d4 <= d3) return b;
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0F && d1 >= 0.0F && d3 <= 0.0F) return a + d1 / (d1 - d3) * ab;
  const Eigen::Vector3f cp = p - c;
  const float d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0.0F && d5 <= d6) return c;
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0F && d2 >= 0.0F && d6 <= 0.0F) return a + d2 / (d2 - d6) * ac;
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0.0F && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  const float scale = 1.0F / (va + vb + vc);
  return a + vb * scale * ab + vc * scale * ac;
}

// A sphere with all corners of a triangle. Its radius has a margin for rounding.
std::pair<Eigen::Vector3f, float> bounding_sphere(const std::array<Eigen::Vector3f, 3>& corners) {
  const Eigen::Vector3f center = (corners[0] + corners[1] + corners[2]) / 3.0F;
  float radius2 = 0.0F;
  for (const Eigen::Vector3f& corner : corners)
    radius2 = std::max(radius2, (corner - center).squaredNorm());
  return {center, 1.001F * std::sqrt(radius2)};
}

// Colour of the corner nearest to a point.
LabelledMesh::Color color_at(const RobotSurface::Triangle& triangle, const Eigen::Vector3f& p) {
  std::array<float, 3> distances2 = {};
  for (std::size_t c = 0; c < 3; ++c) distances2[c] = (triangle.corners[c] - p).squaredNorm();
  return triangle
      .colors[static_cast<std::size_t>(std::ranges::min_element(distances2) - distances2.begin())];
}

std::size_t index_of(int x, int y, int z, int side) {
  return static_cast<std::size_t>(x + side * (y + side * z));
}

}  // namespace

SurfaceFusion::SurfaceFusion(double voxel_m) : voxel_m_(static_cast<float>(voxel_m)) {
  if (!(voxel_m > 0.0))
    throw std::invalid_argument("surface fusion: voxels of " + std::to_string(voxel_m) + " m");
}

std::array<std::int32_t, 3> SurfaceFusion::box_of(const Eigen::Vector3f& point) const {
  const Eigen::Array3f box = (point.array() / side_m()).floor();
  return {static_cast<std::int32_t>(box.x()), static_cast<std::int32_t>(box.y()),
          static_cast<std::int32_t>(box.z())};
}

Eigen::Vector3f SurfaceFusion::position(int x, int y, int z) const {
  return voxel_m_ * Eigen::Vector3f(static_cast<float>(first_[0] + x),
                                    static_cast<float>(first_[1] + y),
                                    static_cast<float>(first_[2] + z));
}

FusedBox SurfaceFusion::fuse(const std::array<std::int32_t, 3>& box,
                             std::span<const RobotSurface> surfaces,
                             std::span<const RobotSurface::Triangle> finer) {
  for (std::size_t axis = 0; axis < 3; ++axis) first_[axis] = kSide * box[axis];
  const std::size_t robots = surfaces.size();
  observations_.resize(std::max(observations_.size(), robots + 1));
  for (std::size_t k = 0; k < robots; ++k) observe(surfaces[k].triangles, observations_[k]);
  observe(finer, observations_[robots]);
  blend(std::span(observations_).first(robots), observations_[robots]);
  return extract();
}

void SurfaceFusion::observe(std::span<const RobotSurface::Triangle> triangles,
                            std::vector<Observation>& observations) const {
  observations.assign(kCorners * kCorners * kCorners, {});
  for (const RobotSurface::Triangle& triangle : triangles) observe(triangle, observations);
}

// Enters the triangle into the voxels of the box to which it is nearest. Several triangles that
// share an edge or a corner may be at the same distance. The one that faces the voxel most counts,
// because the sign of another may be wrong.
void SurfaceFusion::observe(const RobotSurface::Triangle& triangle,
                            std::vector<Observation>& observations) const {
  const auto& [a, b, c] = triangle.corners;
  const Eigen::Vector3f across = (b - a).cross(c - a);
  const float length = across.norm();
  if (!(length > 0.0F)) return;
  const Eigen::Vector3f normal = across / length;
  const float band_m = kBand_voxels * voxel_m_, same_m = kSame_voxels * voxel_m_;
  const auto [center, radius_m] = bounding_sphere(triangle.corners);
  std::array<int, 3> low, high;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [least, most] = std::minmax({a[axis], b[axis], c[axis]});
    const auto first = static_cast<float>(first_[static_cast<std::size_t>(axis)]);
    const float from = std::ceil((least - band_m) / voxel_m_) - first;
    const float to = std::floor((most + band_m) / voxel_m_) - first;
    if (!(to >= 0.0F && from <= static_cast<float>(kSide))) return;
    low[static_cast<std::size_t>(axis)] = static_cast<int>(std::max(from, 0.0F));
    high[static_cast<std::size_t>(axis)] = static_cast<int>(std::min<float>(to, kSide));
  }
  for (int z = low[2]; z <= high[2]; ++z)
    for (int y = low[1]; y <= high[1]; ++y)
      for (int x = low[0]; x <= high[0]; ++x) {
        const Eigen::Vector3f voxel = position(x, y, z);
        Observation& now = observations[index_of(x, y, z, kCorners)];
        const float before = std::abs(now.distance_m);
        // Most triangles are farther away than another one: their bounding sphere shows it.
        const float farthest = (now.cosine < 0.0F ? band_m : before + same_m) + radius_m;
        if ((voxel - center).squaredNorm() > farthest * farthest) continue;
        if (std::abs(normal.dot(voxel - a)) > band_m) continue;
        const Eigen::Vector3f offset = voxel - nearest_point(triangle.corners, voxel);
        const float distance = offset.norm();
        if (distance > band_m) continue;
        const float height = normal.dot(offset);
        const float cosine = distance > same_m ? std::abs(height) / distance : 1.0F;
        const bool nearer = now.cosine < 0.0F || distance < before - same_m;
        if (!nearer && !(distance <= before + same_m && cosine > now.cosine)) continue;
        now = {std::copysign(distance, height), cosine, normal, triangle.label,
               color_at(triangle, voxel)};
      }
}

void SurfaceFusion::blend(std::span<const std::vector<Observation>> robots,
                          std::span<const Observation> finer) {
  fused_.assign(kCorners * kCorners * kCorners, {});
  for (std::size_t v = 0; v < fused_.size(); ++v) {
    const Observation* nearest = nullptr;
    for (const auto& robot : robots) {
      const Observation& seen = robot[v];
      if (seen.cosine < kLeastCosine) continue;
      if (nearest == nullptr || std::abs(seen.distance_m) < std::abs(nearest->distance_m))
        nearest = &seen;
    }
    if (nearest == nullptr) continue;
    const auto counts = [nearest](const Observation& seen) {
      return seen.cosine >= kLeastCosine && seen.normal.dot(nearest->normal) >= kLeastCosine;
    };
    float sum = 0.0F;
    int count = 0, most = 0;
    std::array<int, 3> color = {};
    LabelId label = nearest->label;
    for (const auto& robot : robots) {
      const Observation& seen = robot[v];
      if (!counts(seen)) continue;
      sum += seen.distance_m;
      ++count;
      for (std::size_t c = 0; c < 3; ++c) color[c] += seen.color[c];
      // Unknown has no vote; of labels with as many votes the nearest surface's counts.
      const auto votes = static_cast<int>(std::ranges::count_if(robots, [&](const auto& other) {
        return counts(other[v]) && other[v].label == seen.label;
      }));
      if (seen.label != 0 && (votes > most || (votes == most && seen.label == nearest->label))) {
        most = votes;
        label = seen.label;
      }
    }
    fused_[v] = {sum / static_cast<float>(count), label, {}, true, counts(finer[v])};
    for (std::size_t c = 0; c < 3; ++c)
      fused_[v].color[c] = static_cast<std::uint8_t>(color[c] / count);
  }
}

FusedBox SurfaceFusion::extract() const {
  FusedBox box;
  constexpr std::uint32_t kNone = 0xFFFFFFFF;
  std::vector<std::uint32_t> vertex_on(3 * fused_.size(), kNone);  // by voxel and axis
  const auto at = [&](int x, int y, int z) -> const Fused& {
    return fused_[index_of(x, y, z, kCorners)];
  };
  const auto vertex = [&](int x, int y, int z, int axis) {
    std::uint32_t& index =
        vertex_on[3 * index_of(x, y, z, kCorners) + static_cast<std::size_t>(axis)];
    if (index != kNone) return index;
    index = static_cast<std::uint32_t>(box.vertices.size());
    const Fused& near = at(x, y, z);
    const Fused& far = at(x + (axis == 0), y + (axis == 1), z + (axis == 2));
    const float share =
        std::clamp(near.distance_m / (near.distance_m - far.distance_m), kMargin, 1.0F - kMargin);
    box.edges.push_back(
        {{first_[0] + x, first_[1] + y, first_[2] + z}, static_cast<std::uint8_t>(axis)});
    box.vertices.push_back(position(x, y, z) + share * voxel_m_ * Eigen::Vector3f::Unit(axis));
    box.labels.push_back(share < 0.5F ? near.label : far.label);
    LabelledMesh::Color& color = box.colors.emplace_back();
    for (std::size_t c = 0; c < 3; ++c)
      color[c] = static_cast<std::uint8_t>(
          static_cast<float>(near.color[c]) +
          share * (static_cast<float>(far.color[c]) - static_cast<float>(near.color[c])));
    return index;
  };
  for (int z = 0; z < kSide; ++z)
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) {
        unsigned negative = 0;
        bool known = true, is_finer = true;
        for (int c = 0; c < 8 && known; ++c) {
          const Fused& corner = at(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2 & 1));
          known = corner.known;
          is_finer = is_finer && corner.is_finer;
          if (corner.distance_m < 0.0F) negative |= 1U << static_cast<unsigned>(c);
        }
        if (!known || is_finer) continue;
        for (const MarchingCubes::Triangle& triangle : cubes_.triangles(negative)) {
          LabelledMesh::Face face;
          for (std::size_t i = 0; i < 3; ++i) {
            const int c = MarchingCubes::first_corner_of_edge(triangle[i]);
            face[i] = vertex(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2 & 1),
                             MarchingCubes::axis_of_edge(triangle[i]));
          }
          box.faces.push_back(face);
        }
      }
  return box;
}

}  // namespace km
