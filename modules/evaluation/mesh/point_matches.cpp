#include "modules/evaluation/mesh/point_matches.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <limits>
#include <opencv2/core/utility.hpp>

namespace km {
namespace {

constexpr std::size_t kChunk = 1U << 18;  // points between two reports of progress

Eigen::Vector3f normal_of(const LabelledMesh& mesh, std::uint32_t face) {
  const auto [a, b, c] = mesh.faces[face];
  return (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
}

}  // namespace

void PointMatches::keep_nearer(const PointMatches& other) {
  for (std::size_t i = 0; i < point_m.size(); ++i) {
    point_m[i] = std::min(point_m[i], other.point_m[i]);
    in_front[i] = in_front[i] || other.in_front[i];
    if (other.surface_m[i] >= surface_m[i]) continue;
    surface_m[i] = other.surface_m[i];
    labels[i] = other.labels[i];
  }
}

PointMatches match_points(const SampledMesh& from, const SampledMesh& to,
                          const NearestSurface& nearest_to, double reach_m, std::string_view stage,
                          const MeshProgress& progress) {
  const std::size_t count = from.samples.points.size();
  PointMatches matches;
  matches.point_m.assign(count, std::numeric_limits<float>::infinity());
  matches.surface_m = matches.point_m;
  matches.labels.assign(count, 0);
  std::vector<std::uint8_t> in_front(count, 0);  // threads may write neighbouring bytes, not bits
  const auto match = [&](std::size_t i) {
    const auto near = nearest_to.find(from.samples.points[i], reach_m);
    if (!near) return;
    matches.point_m[i] = near->distance_m;
    matches.surface_m[i] = near->surface_m;
    matches.labels[i] = to.mesh.face_label(near->face);
    const Eigen::Vector3f normal = normal_of(from.mesh, from.samples.faces[i]);
    in_front[i] = !near->past_rim && normal.dot(normal_of(to.mesh, near->face)) > 0.0F ? 1 : 0;
  };
  for (std::size_t start = 0; start < count; start += kChunk) {
    if (progress) progress(stage, static_cast<double>(start) / static_cast<double>(count));
    const auto size = static_cast<int>(std::min(kChunk, count - start));
    cv::parallel_for_(cv::Range(0, size), [&](const cv::Range& range) {
      for (int i = range.start; i < range.end; ++i) match(start + static_cast<std::size_t>(i));
    });
  }
  matches.in_front.assign(in_front.begin(), in_front.end());
  return matches;
}

}  // namespace km
