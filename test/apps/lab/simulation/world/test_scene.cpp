#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "apps/lab/simulation/world/scene.hpp"
#include "test/apps/lab/simulation/world/mesh_checks.hpp"

namespace km {
namespace {

using Eigen::Vector2f;

double area_m2(const SurfaceMesh& mesh) {
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    area += 0.5 *
            (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
  }
  return area;
}

/// Volume inside a closed mesh, positive if its triangles face outwards (divergence theorem).
double volume_m3(const SurfaceMesh& mesh) {
  double volume = 0.0;
  for (const auto& [a, b, c] : mesh.triangles)
    volume += mesh.vertices[a].dot(mesh.vertices[b].cross(mesh.vertices[c])) / 6.0;
  return volume;
}

}  // namespace

TEST_CASE("Closed shapes face outwards and have the volume and area of the solid", "[simulation]") {
  Scene scene;
  double volume = 0.0;
  double area = 0.0;
  double tolerance = 1e-4;  // float
  SECTION("box") {
    scene.box({1, 2, 3}, {3, 5, 7}, 0);
    volume = 24.0;
    area = 52.0;
  }
  SECTION("prism over a house's front") {
    const Vector2f outline[] = {{0, 0}, {8, 0}, {8, 3}, {4, 6}, {0, 3}};
    scene.extrude(outline, -1.0F, 1.0F, 1);
    volume = 2.0 * 36.0;
    area = 2.0 * 36.0 + 2.0 * 24.0;
  }
  SECTION("cylinder") {
    scene.cylinder({1, 1, 1}, {1, 3, 1}, 0.5F, 0.5F, 64, 0);
    volume = std::numbers::pi * 0.25 * 2.0;
    area = std::numbers::pi * (2.0 * 0.25 + 2.0);
    tolerance = 0.004;  // a polygon of 64 corners
  }
  SECTION("cone") {
    scene.cylinder({0, 0, 0}, {0, 0, 3}, 1.0F, 0.0F, 64, 0);
    volume = std::numbers::pi;
    area = std::numbers::pi * (1.0 + std::sqrt(10.0));
    tolerance = 0.004;
  }
  SECTION("ellipsoid") {
    scene.ellipsoid({0, 1, 2}, {1, 1, 1}, 96, 0);
    volume = 4.0 / 3.0 * std::numbers::pi;
    area = 4.0 * std::numbers::pi;
    tolerance = 0.004;
  }
  SECTION("revolved profile") {
    const Vector2f profile[] = {{0, 0}, {1, 0}, {1, 2}, {0, 2}};
    scene.revolve(profile, 96, 0);
    volume = 2.0 * std::numbers::pi;
    area = 6.0 * std::numbers::pi;
    tolerance = 0.004;
  }
  check_sound(scene.mesh(), 3);
  CHECK(volume_m3(scene.mesh()) == Approx(volume).epsilon(tolerance));
  CHECK(area_m2(scene.mesh()) == Approx(area).epsilon(tolerance));
}

}  // namespace km
