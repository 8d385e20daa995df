#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <thread>

#include "apps/lab/simulation/rendering/renderer.hpp"
#include "test/apps/lab/simulation/rendering/small_world.hpp"

namespace km {
namespace {

using small_world::at;
using small_world::Builder;
using small_world::forward_camera;

// Looks straight down from above the origin: the image's right is -y, its top is +x.
SE3 looking_down(double height_m) {
  Eigen::Matrix3d R;
  R << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  return make_pose(R, {0.0, 0.0, height_m});
}

// A floor in the sun; a slab 1 m above its half with x > 0, of which the camera sees no part.
World sunny_floor(bool slab) {
  Builder builder;
  const MaterialId gray = builder.material(SurfaceClass::kRoad, 0.5F);
  builder.scene.quad({-10, -10, 0}, {10, -10, 0}, {10, 10, 0}, {-10, 10, 0}, gray);
  if (slab) builder.scene.box({0.0F, -10.0F, 6.0F}, {10.0F, 10.0F, 6.1F}, gray);
  builder.world().lighting.sun = 1.0F;
  builder.world().lighting.ambient = 0.2F;
  builder.world().lighting.to_sun = Eigen::Vector3f::UnitZ();
  return builder.build();
}

TEST_CASE("A plane in the sun has the radiance of its albedo and light",
          "[simulation][rendering]") {
  const World world = sunny_floor(false);
  const RenderedView view =
      Renderer(world).render(forward_camera(64, 48, 60.0), looking_down(3.0), {});
  // Sun and open sky: 0.5 * (1 + 0.2); the sky's table is baked to some percent.
  for (const float value : view.radiance) CHECK(value == Approx(0.6F).margin(0.02F));
}

TEST_CASE("A slab takes the sun away below it", "[simulation][rendering]") {
  const World world = sunny_floor(true);
  const Camera camera = forward_camera(64, 48, 60.0);
  const RenderedView lit = Renderer(world, {4, false}).render(camera, looking_down(3.0), {});
  const RenderedView dark = Renderer(world, {4, true}).render(camera, looking_down(3.0), {});
  // The upper half of the image is x > 0.
  CHECK(at(dark, 32, 40) == Approx(at(lit, 32, 40)));
  CHECK(at(lit, 32, 8) - at(dark, 32, 8) == Approx(0.5F).margin(1e-4F));
  CHECK(at(dark, 32, 8) > 0.005F);  // light from the side
}

TEST_CASE("Contact is visible without any sun", "[simulation][rendering]") {
  Builder builder;
  const MaterialId gray = builder.material(SurfaceClass::kFloor, 0.5F);
  builder.scene.quad({-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}, gray);
  builder.scene.box({0.5F, -1.0F, 0.0F}, {2.0F, 1.0F, 1.5F}, gray);
  const World world = builder.build();
  const RenderedView view =
      Renderer(world).render(forward_camera(96, 96, 60.0), looking_down(4.0), {});
  // x = 0.45 and x = -1.5 on the floor: rows 47.5 - 60 x / 4.
  const float near = at(view, 48, 41);
  const float open = at(view, 48, 70);
  CHECK(near < 0.85F * open);
  CHECK(near > 0.2F * open);
}

TEST_CASE("A lamp lights by the square of its distance and casts shadows",
          "[simulation][rendering]") {
  Builder builder;
  const MaterialId gray = builder.material(SurfaceClass::kFloor, 1.0F);
  builder.scene.quad({-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}, gray);
  builder.scene.box({1.0F, -5.0F, 0.0F}, {1.1F, 5.0F, 2.0F}, gray);  // hides x > 1 from the lamp
  builder.world().lighting.ambient = 0.0F;
  builder.world().lighting.lamps.push_back({{0.0F, 0.0F, 2.0F}, 4.0F});
  const World world = builder.build();
  const RenderedView view =
      Renderer(world).render(forward_camera(96, 96, 60.0), looking_down(3.5), {});
  // Below the lamp: 4 / 2^2.
  CHECK(at(view, 48, 48) == Approx(1.0F).margin(0.03F));
  // Beyond the screen, seen over its top: nothing.
  CHECK(at(view, 48, 2) < 0.02F);
}

TEST_CASE("Distance fades to the horizon's light", "[simulation][rendering]") {
  const auto contrast = [](float haze_distance_m) {
    Builder builder;
    builder.wall(50.0F, 4.0F, builder.material(SurfaceClass::kWall, 0.0F));
    builder.world().lighting.haze_distance_m = haze_distance_m;
    const World world = builder.build();
    return at(Renderer(world).render(forward_camera(8, 8, 80.0), SE3::Identity(), {}), 4, 4);
  };
  CHECK(contrast(0.0F) == Approx(0.0F).margin(1e-6F));
  CHECK(contrast(50.0F) == Approx(contrast(1e-3F) * (1.0F - std::exp(-1.0F))).epsilon(0.01));
}

TEST_CASE("Views are the same bytes on one thread and on two", "[simulation][rendering]") {
  const World world = sunny_floor(true);
  const PixelRays rays(forward_camera(100, 75, 60.0));
  const RenderRequest everything{true, true, true, true};
  const Renderer renderer(world);
  const RenderedView alone = renderer.render(rays, looking_down(3.0), everything);
  std::array<RenderedView, 2> together;
  {
    std::thread first([&] { together[0] = renderer.render(rays, looking_down(3.0), everything); });
    together[1] = Renderer(world).render(rays, looking_down(3.0), everything);
    first.join();
  }
  for (const RenderedView& view : together) {
    CHECK(view.radiance == alone.radiance);
    CHECK(view.depth_m == alone.depth_m);
    CHECK(view.labels == alone.labels);
    CHECK(std::memcmp(view.rgb.data(), alone.rgb.data(),
                      alone.rgb.size() * sizeof(Eigen::Vector3f)) == 0);
  }
}

}  // namespace
}  // namespace km
