#include "modules/evaluation/mesh/surface_copies.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "modules/evaluation/mesh/mesh_registration.hpp"
#include "modules/evaluation/mesh/sampled_surface.hpp"

namespace km {
namespace {

constexpr float kLeastCosine = 0.5F;

struct Copy {
  Copy(const LabelledMesh& of, const SurfaceCopiesOptions& options)
      : mesh(of), samples(sample_surface(of, options.samples_per_m2, options.seed)) {}

  const LabelledMesh& mesh;
  SurfaceSamples samples;
};

// Not normalised.
Eigen::Vector3f area_normal_of(const LabelledMesh& mesh, std::uint32_t face) {
  const auto& [a, b, c] = mesh.faces[face];
  return (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
}

// Appends the distances from the samples of `from` to their copies in `to`.
void append_distances(const Copy& from, const Copy& to, double reach_m, std::vector<float>& all) {
  const NearestSurface nearest(to.mesh, to.samples);
  for (std::size_t i = 0; i < from.samples.points.size(); ++i) {
    const Eigen::Vector3f& point = from.samples.points[i];
    const auto near = nearest.find(point, reach_m);
    if (!near || near->past_boundary) continue;
    const Eigen::Vector3f normal = area_normal_of(to.mesh, near->face);
    const Eigen::Vector3f own = area_normal_of(from.mesh, from.samples.faces[i]);
    const float length = normal.norm();
    if (!(length > 0.0F) || !(own.dot(normal) >= kLeastCosine * own.norm() * length)) continue;
    const Eigen::Vector3f& corner = to.mesh.vertices[to.mesh.faces[near->face][0]];
    all.push_back(std::abs(normal.dot(point - corner)) / length);
  }
}

std::vector<float> distances(const Copy& a, const Copy& b, double reach_m) {
  std::vector<float> all;
  append_distances(a, b, reach_m, all);
  append_distances(b, a, reach_m, all);
  std::ranges::sort(all);
  return all;
}

double quantile(const std::vector<float>& sorted, double share) {
  if (sorted.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto last = static_cast<double>(sorted.size() - 1);
  return static_cast<double>(sorted[static_cast<std::size_t>(std::lround(share * last))]);
}

}  // namespace

std::optional<SurfaceCopies> compare_copies(const LabelledMesh& a, const LabelledMesh& b,
                                            const SurfaceCopiesOptions& options) {
  const Copy first(a, options), second(b, options);
  const std::size_t samples = first.samples.points.size() + second.samples.points.size();
  if (first.samples.points.empty() || second.samples.points.empty()) return std::nullopt;
  const std::vector<float> found = distances(first, second, options.reach_m);

  OrientedPoints points;
  points.add(b, second.samples);
  const Registration aligned = register_mesh(a, NearestSurface(a, first.samples), points,
                                             SE3::Identity(), {.reach_m = options.reach_m});
  LabelledMesh moved = b;
  moved.transform(aligned.T_truth_estimate);
  return SurfaceCopies{
      .points = found.size(),
      .shared = static_cast<double>(found.size()) / static_cast<double>(samples),
      .median_m = quantile(found, 0.5),
      .p95_m = quantile(found, 0.95),
      .median_aligned_m = quantile(distances(first, Copy(moved, options), options.reach_m), 0.5)};
}

}  // namespace km
