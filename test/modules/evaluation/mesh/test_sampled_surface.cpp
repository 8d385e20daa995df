#include <catch2/catch.hpp>
#include <limits>
#include <random>

#include "modules/evaluation/mesh/sampled_surface.hpp"
#include "test/modules/evaluation/mesh/shapes.hpp"

namespace km {
namespace {

TEST_CASE("A mesh ends at an edge of one face with shared and with separate vertices",
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
  const SurfaceSamples samples = sample_surface(mesh, 1000.0, 1);
  const NearestSurface nearest(mesh, samples);
  for (const float x : {0.1F, 1.0F, 1.5F, 2.9F})  // also at edges and corners of faces
    CHECK_FALSE(nearest.find({x, 1.0F, 0.2F}, 1.0)->past_boundary);
  CHECK(nearest.find({3.1F, 1.0F, 0.2F}, 1.0)->past_boundary);
  CHECK(nearest.find({3.1F, 3.1F, 0.0F}, 1.0)->past_boundary);
  CHECK(nearest.find({3.3F, 3.4F, 0.0F}, 1.0)->surface_m == Approx(0.5F));
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
  CHECK_FALSE(NearestSurface({}, {}).find({0, 0, 0}, 10.0));
}

}  // namespace
}  // namespace km
