#include "modules/mesh/surface_filter.hpp"
#include "test/support/grid_mesh.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr int kCells = 60;
constexpr float kCell_m = 0.05F;

// A floor and, from x = 1.5 m on, a wall that rises at a right angle, with noise of 5 mm.
LabelledMesh noisy_corner(float noise_m) {
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0.0F, noise_m);
  return grid_mesh(kCells, kCells, [&](std::size_t i, std::size_t j) {
    const float along = kCell_m * static_cast<float>(i);
    const float x = std::min(along, 1.5F), z = std::max(along - 1.5F, 0.0F);
    const float e = noise_m > 0.0F ? noise(random) : 0.0F;
    return Eigen::Vector3f(x + (z > 0.0F ? e : 0.0F), kCell_m * static_cast<float>(j),
                           z + (z > 0.0F ? 0.0F : e));
  });
}

// Rms distance to the two planes.
double rms_m(const std::vector<Eigen::Vector3f>& points) {
  double sum = 0.0;
  for (const Eigen::Vector3f& p : points)
    sum += std::pow(static_cast<double>(std::min(std::abs(p.z()), std::abs(p.x() - 1.5F))), 2);
  return std::sqrt(sum / static_cast<double>(points.size()));
}

TEST_CASE("The filter removes noise of walls and keeps their corner") {
  const LabelledMesh noisy = noisy_corner(0.005F), ideal = noisy_corner(0.0F);
  CHECK(rms_m(noisy.vertices) > 0.0045);
  CHECK(rms_m(filter_surface(noisy.vertices, noisy.faces)) < 0.0025);
  const auto kept = filter_surface(ideal.vertices, ideal.faces);
  for (std::size_t v = 0; v < kept.size(); ++v) CHECK((kept[v] - ideal.vertices[v]).norm() < 1e-4F);
}

TEST_CASE("Filtering near a change gives the positions of filtering everything") {
  LabelledMesh mesh = noisy_corner(0.005F);
  auto filtered = filter_surface(mesh.vertices, mesh.faces);
  std::vector<std::uint32_t> changed = {100, 101, 102};
  for (const std::uint32_t v : changed) mesh.vertices[v].z() += 0.01F;
  filter_surface(mesh.vertices, mesh.faces, changed, filtered);
  const auto expected = filter_surface(mesh.vertices, mesh.faces);
  for (std::size_t v = 0; v < expected.size(); ++v)
    CHECK((filtered[v] - expected[v]).norm() < 1e-6F);
}

}  // namespace
}  // namespace km
