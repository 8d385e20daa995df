#include "modules/evaluation/mesh/surface_samples.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <random>

namespace km {
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
  // Systematic sampling: point k lies on the face where the running area passes (k + offset) /
  // per_m2. Faces far smaller than a point's share get their due on average.
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

}  // namespace km
