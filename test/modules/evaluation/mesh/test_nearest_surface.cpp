#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "modules/evaluation/mesh/nearest_surface.hpp"
#include "test/modules/evaluation/mesh/shapes.hpp"

namespace km {

TEST_CASE("Distance to a triangle: inside, sides, corners, degenerate", "[mesh_error]") {
  const Eigen::Vector3d a(0, 0, 0), b(2, 0, 0), c(0, 2, 0);
  const auto distance = [&](double x, double y, double z) {
    return distance_to_triangle({x, y, z}, a, b, c);
  };
  CHECK(distance(0.5, 0.5, 0.3) == Approx(0.3));
  CHECK(distance(0.5, 0.5, -0.3) == Approx(0.3));
  CHECK(distance(1, -1, 0) == Approx(1.0));
  CHECK(distance(1, -3, 4) == Approx(5.0));
  CHECK(distance(2, 2, 0) == Approx(std::sqrt(2.0)));
  CHECK(distance(-3, -4, 0) == Approx(5.0));
  CHECK(distance(5, 0, 4) == Approx(5.0));
  CHECK(distance_to_triangle({0, 3, 4}, a, b, b) == Approx(5.0));
  CHECK(distance_to_triangle({0, 3, 4}, a, a, a) == Approx(5.0));
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
