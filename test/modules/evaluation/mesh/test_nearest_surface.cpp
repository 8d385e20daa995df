#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "modules/evaluation/mesh/mesh_rim.hpp"
#include "modules/evaluation/mesh/nearest_surface.hpp"
#include "test/modules/evaluation/mesh/shapes.hpp"

namespace km {

TEST_CASE("Nearest point of a triangle: inside, edges, corners, degenerate", "[mesh_error]") {
  const Eigen::Vector3d a(0, 0, 0), b(2, 0, 0), c(0, 2, 0);
  const auto expect = [&](const Eigen::Vector3d& point, double distance_m, int edge, int corner) {
    const TrianglePoint found = nearest_on_triangle(point, a, b, c);
    CHECK(found.distance_m == Approx(distance_m));
    CHECK(found.edge == edge);
    CHECK(found.corner == corner);
  };
  expect({0.5, 0.5, 0.3}, 0.3, -1, -1);
  expect({0.5, 0.5, -0.3}, 0.3, -1, -1);
  expect({1, -1, 0}, 1.0, 0, -1);
  expect({1, -3, 4}, 5.0, 0, -1);
  expect({2, 2, 0}, std::sqrt(2.0), 1, -1);
  expect({-1, 1, 0}, 1.0, 2, -1);
  expect({-3, -4, 0}, 5.0, -1, 0);
  expect({5, 0, 4}, 5.0, -1, 1);
  expect({0, 5, 4}, 5.0, -1, 2);
  CHECK(nearest_on_triangle({0, 3, 4}, a, b, b).distance_m == Approx(5.0));
  CHECK(nearest_on_triangle({0, 3, 4}, a, a, a).distance_m == Approx(5.0));
}

TEST_CASE("A mesh ends where an edge has one face, whether vertices are shared or not",
          "[mesh_error]") {
  const bool shared = GENERATE(true, false);
  LabelledMesh mesh = square(3.0F, 0.0F, 3);
  if (!shared) {
    LabelledMesh soup;
    for (const auto& face : mesh.faces) {
      const auto first = static_cast<std::uint32_t>(soup.vertices.size());
      for (const std::uint32_t corner : face) soup.vertices.push_back(mesh.vertices[corner]);
      soup.faces.push_back({first, first + 1, first + 2});
    }
    mesh = soup;
  }
  const MeshRim rim(mesh);
  int edges = 0;
  for (std::size_t face = 0; face < mesh.faces.size(); ++face)
    for (int k = 0; k < 3; ++k) {
      edges += rim.has_edge(face, k) ? 1 : 0;
      const Eigen::Vector3f& place = mesh.vertices[mesh.faces[face][static_cast<std::size_t>(k)]];
      const bool outside = place.head<2>().minCoeff() == 0.0F || place.maxCoeff() == 3.0F;
      CHECK(rim.has_corner(face, k) == outside);
    }
  CHECK(edges == 12);
  const SurfaceSamples samples = sample_surface(mesh, 1000.0, 1);
  const NearestSurface nearest(mesh, samples);
  CHECK_FALSE(nearest.find({1.5F, 1.0F, 0.2F}, 1.0)->past_rim);
  CHECK(nearest.find({3.1F, 1.0F, 0.2F}, 1.0)->past_rim);
  CHECK(nearest.find({3.1F, 3.1F, 0.0F}, 1.0)->past_rim);
}

TEST_CASE("The nearest sample is that of brute force", "[mesh_error]") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  const LabelledMesh mesh = room();
  const SurfaceSamples samples = sample_surface(mesh, 20.0, seed);
  const NearestSurface nearest(mesh, samples);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-1.0F, 5.0F);
  for (int i = 0; i < 200; ++i) {
    const float x = uniform(random), y = uniform(random), z = uniform(random);
    const Eigen::Vector3f point(x, y, z);
    float best = std::numeric_limits<float>::infinity();
    for (const Eigen::Vector3f& sample : samples.points)
      best = std::min(best, (sample - point).norm());
    const auto found = nearest.find(point, 10.0);
    REQUIRE(found);
    CHECK(found->distance_m == Approx(best).epsilon(1e-5));
    CHECK(found->surface_m <= found->distance_m);
    CHECK_FALSE(nearest.find(point, 0.99 * static_cast<double>(best)));
    CHECK(nearest.find(point, 1.01 * static_cast<double>(best)));
  }
}

TEST_CASE("The distance to the surface has no floor from sampling", "[mesh_error]") {
  const LabelledMesh mesh = square(2.0F, 0.0F);
  const SurfaceSamples samples = sample_surface(mesh, 1000.0, 1);
  const NearestSurface nearest(mesh, samples);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0.1F, 1.9F);
  for (int i = 0; i < 200; ++i) {
    const float x = uniform(random), y = uniform(random);
    const auto found = nearest.find({x, y, 0.001F}, 0.5);
    REQUIRE(found);
    CHECK(found->surface_m == Approx(0.001F).margin(1e-6));
  }
}

TEST_CASE("Nothing is near no samples", "[mesh_error]") {
  const LabelledMesh mesh;
  const SurfaceSamples samples;
  CHECK_FALSE(NearestSurface(mesh, samples).find({0, 0, 0}, 10.0));
}

}  // namespace km
