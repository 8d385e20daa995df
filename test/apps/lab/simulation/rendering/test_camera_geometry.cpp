#include <catch2/catch.hpp>
#include <random>
#include <stdexcept>

#include "apps/lab/simulation/rendering/renderer.hpp"
#include "modules/core/lie.hpp"
#include "test/apps/lab/simulation/rendering/small_world.hpp"

namespace km {
namespace {

using small_world::Builder;
using small_world::distorted_camera;
using small_world::forward_camera;

const RenderRequest kEverything{true, true, true, true};

std::size_t pixel(const RenderedView& view, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) +
         static_cast<std::size_t>(x);
}

SE3 tilted_pose() {
  Vector6 xi;
  xi << 0.05, -0.1, 0.08, 0.2, -0.3, 0.4;
  return se3_exp(xi);
}

TEST_CASE("Depth of a plane is the analytic one in every pixel", "[simulation][rendering]") {
  const bool distorted = GENERATE(false, true);
  CAPTURE(distorted);
  const Camera camera = distorted ? distorted_camera(78, 58, 48.0) : forward_camera(78, 58, 48.0);
  Builder builder;
  builder.wall(2.0F, 6.0F, builder.material(SurfaceClass::kWall, 0.5F));
  const World world = builder.build();
  const SE3 T_world_body = tilted_pose();
  const RenderedView view = Renderer(world).render(camera, T_world_body, kEverything);

  const SE3 T_world_cam = T_world_body * camera.T_body_cam;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d bearing = camera.unproject({x, y}).value().homogeneous();
      const double along = (T_world_cam.linear() * bearing).x();
      const double expected = (2.0 - T_world_cam.translation().x()) / along;
      CAPTURE(x, y);
      // Single precision of rays and of the triangle test.
      REQUIRE(view.depth_m[pixel(view, x, y)] == Approx(expected).epsilon(2e-5));
      REQUIRE(view.labels[pixel(view, x, y)] == static_cast<LabelId>(SurfaceClass::kWall));
    }
  }
}

TEST_CASE("A fisheye sees a plane within its field of view, and black beyond",
          "[simulation][rendering]") {
  const Lens lens = GENERATE(Lens(LensModel::kEquidistant, {0.003, 7e-4, -2e-3, 2e-4}),
                             Lens(LensModel::kOmnidirectional, {1.2, 0.0, 0.0, 0.0, 0.0}),
                             Lens(LensModel::kDoubleSphere, {-0.17, 0.59}));
  CAPTURE(to_string(lens.model()));
  Camera camera = forward_camera(97, 93, 30.0);
  camera.lens = lens;
  Builder builder;
  builder.wall(2.0F, 16.0F, builder.material(SurfaceClass::kWall, 0.5F));
  const World world = builder.build();
  const PixelRays rays(camera);
  const RenderedView view = Renderer(world).render(rays, SE3::Identity(), kEverything);
  int lit = 0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const std::size_t at = pixel(view, x, y);
      CAPTURE(x, y);
      const auto bearing = camera.unproject({x, y});
      const bool seen = bearing && camera.unproject({x + 1, y}) && camera.unproject({x, y + 1});
      REQUIRE(rays.is_lit(at) == seen);
      if (seen) {
        ++lit;
        REQUIRE(view.depth_m[at] == Approx(2.0).epsilon(2e-5));
        REQUIRE(view.labels[at] == static_cast<LabelId>(SurfaceClass::kWall));
        REQUIRE(view.radiance[at] > 0.01F);
      } else {
        REQUIRE(view.depth_m[at] == 0.0F);
        REQUIRE(view.labels[at] == static_cast<LabelId>(SurfaceClass::kUnknown));
        REQUIRE(view.radiance[at] == 0.0F);
        REQUIRE(view.rgb[at].isZero());
      }
    }
  }
  CHECK(lit > 0.5 * 97 * 93);
  CHECK(lit < 0.95 * 97 * 93);
}

TEST_CASE("A box hides only the surfaces behind it", "[simulation][rendering]") {
  const Camera camera = distorted_camera(62, 46, 40.0);
  Builder builder;
  builder.wall(8.0F, 3.0F, builder.material(SurfaceClass::kWall, 0.5F));
  builder.scene.box({4.0F, -0.5F, -0.25F}, {5.0F, 0.5F, 0.75F},
                    builder.material(SurfaceClass::kVehicle, 0.5F));
  const World world = builder.build();
  const RenderedView view = Renderer(world).render(camera, SE3::Identity(), kEverything);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector2d bearing = camera.unproject({x, y}).value();
      // Intersections of the ray with the planes x = 4 and x = 8 of the world; left is +y, up is
      // +z.
      const Eigen::Vector2d near = -4.0 * bearing;
      const Eigen::Vector2d far = -8.0 * bearing;
      const bool box = std::abs(near.x()) < 0.5 && near.y() > -0.25 && near.y() < 0.75;
      const bool wall = far.cwiseAbs().maxCoeff() < 3.0;
      const SurfaceClass label = box    ? SurfaceClass::kVehicle
                                 : wall ? SurfaceClass::kWall
                                        : SurfaceClass::kSky;
      CAPTURE(x, y);
      REQUIRE(view.labels[pixel(view, x, y)] == static_cast<LabelId>(label));
      const double depth = box ? 4.0 : wall ? 8.0 : 0.0;
      REQUIRE(view.depth_m[pixel(view, x, y)] == Approx(depth).epsilon(2e-5));
    }
  }
}

TEST_CASE("A known point appears at its projection by the camera model",
          "[simulation][rendering]") {
  const int seed = GENERATE(1, 2, 3, 4);
  CAPTURE(seed);
  std::mt19937 random(static_cast<std::mt19937::result_type>(seed));
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const Camera camera = distorted_camera(376, 240, 230.0);
  const double y = 1.5 * uniform(random);
  const double z = 0.8 * uniform(random);
  const Eigen::Vector3d point(3.0, y, z);
  Builder builder;
  const MaterialId white = builder.material(SurfaceClass::kObject, 1.0F);
  const MaterialId black = builder.material(SurfaceClass::kWall, 0.0F);
  const Eigen::Vector3f low = point.cast<float>() - Eigen::Vector3f(0.0F, 0.02F, 0.02F);
  const Eigen::Vector3f high = point.cast<float>() + Eigen::Vector3f(0.001F, 0.02F, 0.02F);
  builder.scene.box(low, high, white);
  builder.wall(3.5F, 5.0F, black);
  const World world = builder.build();
  Vector6 xi;
  xi << 0.03 * uniform(random), 0.0, 0.0, 0.1, 0.1 * uniform(random), 0.0;
  const SE3 T_world_body = se3_exp(xi);
  const RenderedView view = Renderer(world, {16, true}).render(camera, T_world_body, {});

  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  double mass = 0.0;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const double value = static_cast<double>(view.radiance[pixel(view, u, v)]);
      centroid += value * Eigen::Vector2d(u, v);
      mass += value;
    }
  }
  REQUIRE(mass > 1.0);
  const Eigen::Vector3d in_camera = (T_world_body * camera.T_body_cam).inverse() * point;
  const Eigen::Vector2d expected = camera.project(in_camera.hnormalized()).value();
  constexpr double kTolerance_px = 0.1;
  CHECK((centroid / mass - expected).norm() < kTolerance_px);
}

TEST_CASE("An empty world is sky to the rim", "[simulation][rendering]") {
  const World world = Builder().build();
  const Camera camera = forward_camera(33, 21, 30.0);  // no multiple of a packet
  const RenderedView view = Renderer(world).render(camera, SE3::Identity(), kEverything);
  REQUIRE(view.radiance.size() == 33U * 21U);
  for (std::size_t i = 0; i < view.radiance.size(); ++i) {
    CHECK(view.radiance[i] > 0.0F);
    CHECK(view.depth_m[i] == 0.0F);
    CHECK(view.labels[i] == static_cast<LabelId>(SurfaceClass::kSky));
  }
}

TEST_CASE("A camera inside a solid sees its inner sides", "[simulation][rendering]") {
  Builder builder;
  builder.scene.box({-2.0F, -2.0F, -2.0F}, {2.0F, 2.0F, 2.0F},
                    builder.material(SurfaceClass::kFurniture, 0.5F));
  const World world = builder.build();
  const RenderedView view =
      Renderer(world).render(forward_camera(40, 30, 30.0), SE3::Identity(), kEverything);
  for (std::size_t i = 0; i < view.depth_m.size(); ++i) {
    CHECK(view.depth_m[i] == Approx(2.0F));
    CHECK(std::isfinite(view.radiance[i]));
    CHECK(view.labels[i] == static_cast<LabelId>(SurfaceClass::kFurniture));
  }
}

TEST_CASE("Only the requested images are rendered", "[simulation][rendering]") {
  const World world = Builder().build();
  const Camera camera = forward_camera(16, 16, 16.0);
  const RenderedView view =
      Renderer(world).render(camera, SE3::Identity(), {false, false, true, false});
  CHECK(view.radiance.empty());
  CHECK(view.rgb.empty());
  CHECK(view.labels.empty());
  CHECK(view.depth_m.size() == 256);
}

TEST_CASE("Cameras and worlds that cannot be rendered are refused", "[simulation][rendering]") {
  Camera camera = forward_camera(16, 16, 16.0);
  camera.width = 0;
  CHECK_THROWS_AS(PixelRays(camera), std::invalid_argument);
  camera = forward_camera(16, 16, 0.0);
  CHECK_THROWS_AS(PixelRays(camera), std::invalid_argument);
  CHECK_THROWS_AS(shrunk(forward_camera(16, 16, 16.0), 0), std::invalid_argument);

  Builder builder;
  builder.wall(5.0F, 1.0F, builder.material(SurfaceClass::kWall, 0.5F));
  World world = builder.build();
  world.mesh.materials[0] = 7;
  CHECK_THROWS_AS(Renderer(world), std::invalid_argument);
}

TEST_CASE("A shrunk camera sees the same field of view", "[simulation][rendering]") {
  const Camera camera = distorted_camera(752, 480, 458.0);
  const Camera small = shrunk(camera, 8);
  CHECK(small.width == 94);
  CHECK(small.height == 60);
  const Eigen::Vector2d corner = camera.unproject({-0.5, -0.5}).value();
  CHECK((small.unproject({-0.5, -0.5}).value() - corner).norm() < 1e-9);
}

}  // namespace
}  // namespace km
