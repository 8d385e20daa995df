#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <set>
#include <stdexcept>
#include <vector>

#include "apps/lab/simulation/world/routes.hpp"
#include "apps/lab/simulation/world/scene.hpp"
#include "apps/lab/simulation/world/terrain.hpp"
#include "test/apps/lab/simulation/world/mesh_checks.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

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
  SECTION("prism over an L") {
    const Vector2f outline[] = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 3}, {0, 3}};
    scene.extrude(outline, -1.0F, 1.0F, 1);
    volume = 8.0;
    area = 2.0 * 4.0 + 2.0 * 10.0;
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

TEST_CASE("Equal requests share a material, and recipes share textures", "[simulation][texture]") {
  Scene scene(1);
  const Eigen::Vector3f red(0.8F, 0.1F, 0.1F);
  const MaterialId wall = scene.paint(SurfaceClass::kWall, Recipe::kCanvas);
  CHECK(scene.paint(SurfaceClass::kWall, Recipe::kCanvas) == wall);
  const MaterialId tent = scene.paint(SurfaceClass::kTent, Recipe::kCanvas, red, 0.5F);
  const MaterialId lamp =
      scene.paint(SurfaceClass::kCeiling, Recipe::kPlain, red, 1.0F, 0.25F, 3.0F);
  CHECK(std::set{wall, tent, lamp}.size() == 3);

  World world;
  scene.move_to(world);
  REQUIRE(world.materials.size() == 3);
  CHECK(world.textures.size() == 4);  // canvas, its grain, plain, its flat detail
  const Material& material = world.materials[tent];
  CHECK(material.label == SurfaceClass::kTent);
  CHECK(material.tint == red);
  CHECK(material.base == world.materials[wall].base);
  CHECK(material.base_period_m == 0.5F * traits_of(Recipe::kCanvas).period_m);
  CHECK(material.detail_period_m == 0.5F * traits_of(Recipe::kCanvas).detail_period_m);
  CHECK(world.textures[material.base].size() == traits_of(Recipe::kCanvas).size);
  CHECK(world.materials[lamp].specular == 0.25F);
  CHECK(world.materials[lamp].glow == 3.0F);
  CHECK(scene.paint(SurfaceClass::kWall, Recipe::kCanvas) ==
        0);  // the next scene begins from scratch
}

TEST_CASE("Frames nest, and end with their scope", "[simulation]") {
  Scene scene;
  {
    const auto outer = scene.at({10, 0, 0}, 0.5F * kPi);
    const auto inner = scene.at({1, 0, 2});
    scene.triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
  }
  scene.triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
  // x of the outer frame is y of the world.
  CHECK((scene.mesh().vertices[0] - Vector3f(10, 1, 2)).norm() < 1e-5F);
  CHECK((scene.mesh().vertices[1] - Vector3f(10, 2, 2)).norm() < 1e-5F);
  CHECK((scene.mesh().vertices[2] - Vector3f(9, 1, 2)).norm() < 1e-5F);
  CHECK(scene.mesh().vertices[3].isZero());
}

TEST_CASE("Texture coordinates keep lengths and run on over neighbours", "[simulation]") {
  Scene scene;
  const auto side = GENERATE(as<std::array<Vector3f, 2>>{},
                             std::array<Vector3f, 2>{Vector3f(1, 0, 0), Vector3f(0, 0, 1)},
                             std::array<Vector3f, 2>{Vector3f(0, 1, 0), Vector3f(0, 0, 1)},
                             std::array<Vector3f, 2>{Vector3f(1, 0, 0), Vector3f(0, 1, 0)},
                             std::array<Vector3f, 2>{Vector3f(1, 0, 0), Vector3f(0, 0.6F, 0.8F)});
  const auto& [u, v] = side;
  const Vector3f origin(3, -2, 1);
  scene.quad(origin, origin + 2 * u, origin + 2 * u + v, origin + v, 0);
  scene.quad(origin + 2 * u, origin + 5 * u, origin + 5 * u + v, origin + 2 * u + v, 0);
  const SurfaceMesh& m = scene.mesh();
  for (const auto& [a, b, c] : m.triangles) {
    CHECK((m.uv[b] - m.uv[a]).norm() == Approx((m.vertices[b] - m.vertices[a]).norm()));
    CHECK((m.uv[c] - m.uv[b]).norm() == Approx((m.vertices[c] - m.vertices[b]).norm()));
  }
  CHECK((m.uv[1] - m.uv[4]).norm() < 1e-5F);  // the shared corner
}

TEST_CASE("Triangles without area are left out", "[simulation]") {
  Scene scene;
  scene.triangle({0, 0, 0}, {1, 0, 0}, {2, 0, 0}, 0);
  scene.quad({0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {0, 0, 0}, 0);
  CHECK(scene.mesh().triangles.size() == 0);
  scene.quad({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 0}, 0);
  CHECK(scene.mesh().triangles.size() == 1);
}

TEST_CASE("An outline that is not counter-clockwise is refused", "[simulation]") {
  Scene scene;
  const Vector2f clockwise[] = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};
  CHECK_THROWS_AS(scene.polygon(clockwise, 0.0F, 0), std::invalid_argument);
}

TEST_CASE("Leaves have sound normals and lie within their cluster", "[simulation]") {
  Scene scene;
  SeededRandom random(GENERATE(1, 2, 3));
  scene.leaf_cluster({5, 6, 7}, {1, 2, 0.5F}, 200, 0.2F, 2, random);
  check_sound(scene.mesh(), 3);
  CHECK(scene.mesh().triangles.size() == 400);
  for (const Vector3f& p : scene.mesh().vertices)
    CHECK((p - Vector3f(5, 6, 7)).cwiseQuotient(Vector3f(1.2F, 2.2F, 0.7F)).norm() < 1.05F);
}

TEST_CASE("A sheet leaves out cells without material and the vertices of none", "[simulation]") {
  Scene scene;
  scene.sheet(
      2, 3,
      [](int row, int column) {
        return Vector3f(static_cast<float>(column), static_cast<float>(row), 0.0F);
      },
      [](int row, int column) -> std::optional<MaterialId> {
        if (row == 1) return std::nullopt;
        return static_cast<MaterialId>(column % 2);
      });
  check_sound(scene.mesh(), 3);
  CHECK(scene.mesh().triangles.size() == 6);
  CHECK(scene.mesh().vertices.size() == 8);
  CHECK(scene.mesh().materials == std::vector<MaterialId>{0, 0, 1, 1, 0, 0});
}

TEST_CASE("A height field's surface is that of its sheet", "[simulation]") {
  const Heightfield field({-1, 2}, 0.5F, 4, 3, [](float x, float y) { return x * x - 0.5F * y; });
  Scene scene;
  scene.sheet(
      3, 4, [&](int row, int column) { return field.point(row, column); }, MaterialId{0}, true);
  for (const auto& [a, b, c] : scene.mesh().triangles) {
    const Vector3f p = 0.2F * scene.mesh().vertices[a] + 0.3F * scene.mesh().vertices[b] +
                       0.5F * scene.mesh().vertices[c];
    CHECK(field.at(p.x(), p.y()) == Approx(p.z()).margin(1e-5));
  }
  CHECK(field.at(-9.0, 2.0) == Approx(field.at(-1.0, 2.0)));
  CHECK(!field.contains(-9.0, 2.0));
}

TEST_CASE("A lane lies at its distance to the right of the way", "[simulation]") {
  const std::vector<Eigen::Vector2d> square = {{0, 0}, {10, 0}, {10, 10}, {0, 10}};
  // Driven counter-clockwise, right is outside.
  const std::vector<Eigen::Vector2d> lane = right_hand_lane(square, 1.0);
  REQUIRE(lane.size() == 4);
  CHECK((lane[0] - Eigen::Vector2d(-1, -1)).norm() < 1e-12);
  CHECK((lane[2] - Eigen::Vector2d(11, 11)).norm() < 1e-12);
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
