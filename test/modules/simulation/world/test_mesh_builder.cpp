#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "modules/simulation/world/lane.hpp"
#include "modules/simulation/world/mesh_builder.hpp"
#include "modules/simulation/world/terrain.hpp"
#include "test/modules/simulation/world/world_checks.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;

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
  for (const auto& [a, b, c] : mesh.triangles) {
    volume += mesh.vertices[a].dot(mesh.vertices[b].cross(mesh.vertices[c])) / 6.0;
  }
  return volume;
}

void check_no_faults(const SurfaceMesh& mesh) {
  const MeshFaults faults = faults_of(mesh, 3);
  CHECK(faults.sizes == 0);
  CHECK(faults.not_finite == 0);
  CHECK(faults.normal_length == 0);
  CHECK(faults.index_range == 0);
  CHECK(faults.no_area == 0);
  CHECK(faults.winding == 0);
}

}  // namespace

TEST_CASE("Closed shapes face outwards and have the volume and area of the solid", "[simulation]") {
  MeshBuilder mesh;
  double volume = 0.0;
  double area = 0.0;
  double tolerance = 1e-4;  // float
  SECTION("box") {
    mesh.box({1, 2, 3}, {3, 5, 7}, 0);
    volume = 24.0;
    area = 52.0;
  }
  SECTION("prism over an L") {
    const std::array<Vector2f, 6> outline = {{{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 3}, {0, 3}}};
    mesh.extrude(outline, -1.0F, 1.0F, 1, 2);
    volume = 8.0;
    area = 2.0 * 4.0 + 2.0 * 10.0;
  }
  SECTION("cylinder") {
    mesh.cylinder({1, 1, 1}, {1, 3, 1}, 0.5F, 0.5F, 64, 0);
    volume = std::numbers::pi * 0.25 * 2.0;
    area = std::numbers::pi * (2.0 * 0.25 + 2.0);
    tolerance = 0.004;  // a polygon of 64 corners
  }
  SECTION("cone") {
    mesh.cylinder({0, 0, 0}, {0, 0, 3}, 1.0F, 0.0F, 64, 0);
    volume = std::numbers::pi;
    area = std::numbers::pi * (1.0 + std::sqrt(10.0));
    tolerance = 0.004;
  }
  SECTION("ellipsoid") {
    mesh.ellipsoid({0, 1, 2}, {1, 1, 1}, 96, 0);
    volume = 4.0 / 3.0 * std::numbers::pi;
    area = 4.0 * std::numbers::pi;
    tolerance = 0.004;
  }
  SECTION("revolved profile") {
    const std::array<Vector2f, 4> profile = {{{0, 0}, {1, 0}, {1, 2}, {0, 2}}};
    mesh.revolve(profile, 96, 0);
    volume = 2.0 * std::numbers::pi;
    area = 6.0 * std::numbers::pi;
    tolerance = 0.004;
  }
  check_no_faults(mesh.mesh());
  CHECK(volume_m3(mesh.mesh()) == Approx(volume).epsilon(tolerance));
  CHECK(area_m2(mesh.mesh()) == Approx(area).epsilon(tolerance));
}

TEST_CASE("Frames nest, and end where their scope does", "[simulation]") {
  MeshBuilder mesh;
  {
    const ScopedFrame outer(mesh, standing_at({10, 0, 0}, 0.5F * kPi));
    const ScopedFrame inner(mesh, standing_at({1, 0, 2}, 0.0F));
    mesh.triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
  }
  mesh.triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
  // x of the outer frame is y of the world.
  CHECK((mesh.mesh().vertices[0] - Vector3f(10, 1, 2)).norm() < 1e-5F);
  CHECK((mesh.mesh().vertices[1] - Vector3f(10, 2, 2)).norm() < 1e-5F);
  CHECK((mesh.mesh().vertices[2] - Vector3f(9, 1, 2)).norm() < 1e-5F);
  CHECK(mesh.mesh().vertices[3].isZero());
}

TEST_CASE("Texture coordinates keep lengths and run on over neighbours", "[simulation]") {
  MeshBuilder mesh;
  const auto side = GENERATE(as<std::array<Vector3f, 2>>{},
                             std::array<Vector3f, 2>{Vector3f(1, 0, 0), Vector3f(0, 0, 1)},
                             std::array<Vector3f, 2>{Vector3f(0, 1, 0), Vector3f(0, 0, 1)},
                             std::array<Vector3f, 2>{Vector3f(1, 0, 0), Vector3f(0, 1, 0)},
                             std::array<Vector3f, 2>{Vector3f(1, 0, 0), Vector3f(0, 0.6F, 0.8F)});
  const auto& [u, v] = side;
  const Vector3f origin(3, -2, 1);
  mesh.quad(origin, origin + 2 * u, origin + 2 * u + v, origin + v, 0);
  mesh.quad(origin + 2 * u, origin + 5 * u, origin + 5 * u + v, origin + 2 * u + v, 0);
  const SurfaceMesh& m = mesh.mesh();
  for (const auto& [a, b, c] : m.triangles) {
    CHECK((m.uv[b] - m.uv[a]).norm() == Approx((m.vertices[b] - m.vertices[a]).norm()));
    CHECK((m.uv[c] - m.uv[b]).norm() == Approx((m.vertices[c] - m.vertices[b]).norm()));
  }
  CHECK((m.uv[1] - m.uv[4]).norm() < 1e-5F);  // the shared corner
}

TEST_CASE("Triangles without area are left out", "[simulation]") {
  MeshBuilder mesh;
  mesh.triangle({0, 0, 0}, {1, 0, 0}, {2, 0, 0}, 0);
  mesh.quad({0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {0, 0, 0}, 0);
  CHECK(mesh.triangle_count() == 0);
  mesh.quad({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 0}, 0);
  CHECK(mesh.triangle_count() == 1);
}

TEST_CASE("An outline that is not counter-clockwise is refused", "[simulation]") {
  MeshBuilder mesh;
  const std::array<Vector2f, 4> clockwise = {{{0, 0}, {0, 1}, {1, 1}, {1, 0}}};
  CHECK_THROWS_AS(mesh.polygon(clockwise, 0.0F, 0), std::invalid_argument);
}

TEST_CASE("Leaves have sound normals and lie within their cluster", "[simulation]") {
  MeshBuilder mesh;
  SeededRandom random(GENERATE(1, 2, 3));
  mesh.leaf_cluster({5, 6, 7}, {1, 2, 0.5F}, 200, 0.2F, 2, random);
  check_no_faults(mesh.mesh());
  CHECK(mesh.triangle_count() == 400);
  for (const Vector3f& p : mesh.mesh().vertices) {
    CHECK((p - Vector3f(5, 6, 7)).cwiseQuotient(Vector3f(1.2F, 2.2F, 0.7F)).norm() < 1.05F);
  }
}

TEST_CASE("A sheet leaves out cells without material and the vertices of none", "[simulation]") {
  MeshBuilder mesh;
  mesh.sheet(
      2, 3,
      [](int row, int column) {
        return Vector3f(static_cast<float>(column), static_cast<float>(row), 0.0F);
      },
      [](int row, int column) -> std::optional<MaterialId> {
        if (row == 1) return std::nullopt;
        return static_cast<MaterialId>(column % 2);
      });
  check_no_faults(mesh.mesh());
  CHECK(mesh.triangle_count() == 6);
  CHECK(mesh.mesh().vertices.size() == 8);
  CHECK(mesh.mesh().materials == std::vector<MaterialId>{0, 0, 1, 1, 0, 0});
}

TEST_CASE("A height field's surface is that of its sheet", "[simulation]") {
  const Heightfield field({-1, 2}, 0.5F, 4, 3, [](float x, float y) { return x * x - 0.5F * y; });
  MeshBuilder mesh;
  mesh.sheet(
      3, 4, [&](int row, int column) { return field.point(row, column); }, MaterialId{0}, true);
  for (const auto& [a, b, c] : mesh.mesh().triangles) {
    const Vector3f p = 0.2F * mesh.mesh().vertices[a] + 0.3F * mesh.mesh().vertices[b] +
                       0.5F * mesh.mesh().vertices[c];
    CHECK(field.at(p.x(), p.y()) == Approx(p.z()).margin(1e-5));
  }
  CHECK(field.at(-9.0, 2.0) == Approx(field.at(-1.0, 2.0)));
  CHECK(!field.contains(-9.0, 2.0));
}

TEST_CASE("Meshes are appended with their indices", "[simulation]") {
  MeshBuilder one;
  one.box({0, 0, 0}, {1, 1, 1}, 0);
  MeshBuilder two;
  two.box({2, 0, 0}, {3, 1, 1}, 1);
  SurfaceMesh both = one.take();
  both.append(two.mesh());
  check_no_faults(both);
  CHECK(volume_m3(both) == Approx(2.0));
  CHECK(both.materials.back() == 1);
}

TEST_CASE("A lane lies at its distance to the right of the way", "[simulation]") {
  const std::vector<Eigen::Vector2d> square = {{0, 0}, {10, 0}, {10, 10}, {0, 10}};
  // Driven counter-clockwise, right is outside.
  const std::vector<Eigen::Vector2d> lane = right_hand_lane(square, 1.0);
  REQUIRE(lane.size() == 4);
  CHECK((lane[0] - Eigen::Vector2d(-1, -1)).norm() < 1e-12);
  CHECK((lane[2] - Eigen::Vector2d(11, 11)).norm() < 1e-12);
  CHECK(distance_to_way({5.0, 0.0}, lane) == Approx(1.0));
  CHECK_THROWS_AS(right_hand_lane(std::vector<Eigen::Vector2d>{{0, 0}, {1, 0}}, 1.0),
                  std::invalid_argument);
  CHECK_THROWS_AS(right_hand_lane(std::vector<Eigen::Vector2d>{{0, 0}, {5, 0}, {2, 0}}, 1.0),
                  std::invalid_argument);
}

TEST_CASE("Draws are uniform in mean and differ between streams", "[simulation]") {
  SeededRandom random = SeededRandom::stream(3, 1);
  SeededRandom again = SeededRandom::stream(3, 1);
  SeededRandom other = SeededRandom::stream(3, 2);
  double sum = 0.0;
  int repeated = 0;
  int equal = 0;
  constexpr int kDraws = 20000;
  for (int i = 0; i < kDraws; ++i) {
    const double x = random.unit();
    repeated += static_cast<int>(x == again.unit());
    equal += static_cast<int>(x == other.unit());
    sum += x;
  }
  // Standard error of the mean: sqrt(1 / 12 / 20000) = 0.002.
  CHECK(sum / kDraws == Approx(0.5).margin(0.01));
  CHECK(repeated == kDraws);
  CHECK(equal < 3);
}

}  // namespace km
