#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "apps/lab/simulation/rendering/light_passages.hpp"
#include "apps/lab/simulation/rendering/moved_surfaces.hpp"
#include "apps/lab/simulation/rendering/sensor_effects.hpp"
#include "apps/lab/simulation/world/objects.hpp"
#include "modules/core/lie.hpp"
#include "test/apps/lab/simulation/rendering/small_world.hpp"

namespace km {
namespace {

using small_world::at;
using small_world::Builder;
using small_world::forward_camera;

SE3 turned_left(double yaw_rad) {
  return make_pose(so3_exp({0.0, 0.0, yaw_rad}), Eigen::Vector3d::Zero());
}

// A wall at 5 m, black on the left and white on the right of the x axis.
World edge_world() {
  Builder builder;
  const MaterialId black = builder.material(SurfaceClass::kWall, 0.0F);
  const MaterialId white = builder.material(SurfaceClass::kWall, 1.0F);
  builder.scene.quad({5, 9, -9}, {5, 0, -9}, {5, 0, 9}, {5, 9, 9}, black);
  builder.scene.quad({5, 0, -9}, {5, -9, -9}, {5, -9, 9}, {5, 0, 9}, white);
  return builder.build();
}

// Position of the edge in a row: its black pixels, the mixed one in part.
double edge_px(const RenderedView& view, int row) {
  double black = 0.0;
  for (int x = 0; x < view.width; ++x)
    black += 1.0 - static_cast<double>(at(view, x, row) / at(view, view.width - 1, row));
  return black;
}

// A view of a uniform scene, without what does not belong to clutter.
SensorEffectsConfig clean_sensor() {
  SensorEffectsConfig config;
  config.vignetting = config.lens_blur_px = config.read_noise = config.photon_noise = 0.0;
  config.motion_blur = false;
  return config;
}

RenderedView uniform_view(const Camera& camera, float radiance) {
  RenderedView view;
  view.width = camera.width;
  view.height = camera.height;
  view.radiance.assign(static_cast<std::size_t>(camera.width * camera.height), radiance);
  return view;
}

Shot plain_shot() {
  Shot shot;
  shot.exposure = {1.0, 0.01};
  return shot;
}

}  // namespace

TEST_CASE("A rolling shutter shears a vertical edge by rate * focal length * time of a row",
          "[simulation][rendering]") {
  const World world = edge_world();
  const Renderer renderer(world, {16, true});
  const Camera camera = forward_camera(120, 80, 100.0);
  SensorEffectsConfig config;
  config.rolling_shutter_s = 0.04;
  const double rate_rps = GENERATE(1.5, -1.5);
  std::vector<SE3> poses;
  for (int row = 0; row < camera.height; ++row)
    poses.push_back(turned_left(rate_rps * row_delay_s(config, row, camera.height)));
  const RenderedView view = renderer.render(PixelRays(camera), poses, {});
  const double shear_px = rate_rps * camera.fx * config.rolling_shutter_s / camera.height;
  for (const int row : {5, 20, 60, 75}) {
    CAPTURE(row, rate_rps);
    // 16 samples of a pixel know an edge to a sixteenth; the tangent of 0.03 rad adds 0.001 px.
    CHECK(edge_px(view, row) == Approx(60.0 + shear_px * (row + 0.5 - 40.0)).margin(0.08));
  }
}

TEST_CASE("Equal poses of all rows make the same image as one pose", "[simulation][rendering]") {
  const World world = edge_world();
  const Renderer renderer(world);
  const PixelRays rays(small_world::distorted_camera(64, 48, 50.0));
  const SE3 pose = turned_left(0.13);
  const RenderRequest request{true, true, true, true};
  const RenderedView one = renderer.render(rays, pose, request);
  const RenderedView rows = renderer.render(rays, std::vector<SE3>(48, pose), request);
  CHECK(one.radiance == rows.radiance);
  CHECK(one.depth_m == rows.depth_m);
  CHECK(one.labels == rows.labels);
  CHECK_THROWS_AS(renderer.render(rays, std::vector<SE3>(47, pose), request),
                  std::invalid_argument);
}

TEST_CASE("A moved car is at its pose in the images of labels and depth",
          "[simulation][rendering]") {
  Builder builder;
  builder.wall(30.0F, 60.0F, builder.material(SurfaceClass::kWall, 0.5F));
  const World world = builder.build();
  const Renderer renderer(world);
  Scene scene;
  SeededRandom random(3);
  add_vehicle(scene, VehicleKind::kSedan, random);
  World shapes;
  scene.move_to(shapes);
  const SE3 T_world_car =
      make_pose(so3_exp({0.0, 0.0, GENERATE(0.0, 0.7, 2.5)}), {GENERATE(8.0, 14.0), 1.0, -1.2});
  const MovedSurfaces moved(shapes, std::vector<SE3>{T_world_car});
  const PixelRays rays(forward_camera(160, 120, 140.0));
  const std::vector<SE3> poses = {SE3::Identity()};
  const RenderRequest request{true, false, true, true};
  const RenderedView with = renderer.render(rays, poses, request, &moved);
  const RenderedView without = renderer.render(rays, poses, request);

  Eigen::AlignedBox2d projected, seen;
  float nearest_m = 1e9F;
  const SE3 T_cam_car = rays.camera().T_body_cam.inverse() * T_world_car;
  for (const Eigen::Vector3f& vertex : shapes.mesh.vertices) {
    const Eigen::Vector3d p = T_cam_car * vertex.cast<double>();
    projected.extend(rays.camera().project_ray(p).value());
    nearest_m = std::min(nearest_m, static_cast<float>(p.z()));
  }
  float depth_m = 1e9F;
  for (std::size_t i = 0; i < with.labels.size(); ++i) {
    CHECK(without.labels[i] != static_cast<LabelId>(SurfaceClass::kVehicle));
    if (with.labels[i] != static_cast<LabelId>(SurfaceClass::kVehicle)) {
      REQUIRE(with.depth_m[i] == without.depth_m[i]);
      continue;
    }
    seen.extend(Eigen::Vector2d(static_cast<double>(i % 160), static_cast<double>(i / 160)));
    depth_m = std::min(depth_m, with.depth_m[i]);
  }
  REQUIRE_FALSE(seen.isEmpty());
  // A pixel belongs to the car if its centre does; corners narrower than a pixel may be missed.
  CHECK((seen.min() - projected.min()).cwiseAbs().maxCoeff() < 1.5);
  CHECK((seen.max() - projected.max()).cwiseAbs().maxCoeff() < 1.5);
  CHECK(depth_m > nearest_m - 1e-4F);
  CHECK(depth_m < nearest_m + 0.3F);
}

TEST_CASE("A moved thing needs a pose for each object", "[simulation][rendering]") {
  Scene scene;
  SeededRandom random(3);
  add_person(scene, random);
  World shapes;
  scene.move_to(shapes);
  CHECK_THROWS_AS(MovedSurfaces(shapes, std::vector<SE3>(2)), std::invalid_argument);
}

TEST_CASE("Passages multiply the light by the factor or its inverse", "[simulation][exposure]") {
  SensorEffectsConfig config;
  config.passage_light = 8.0;
  config.passage_every_s = 10.0;
  config.passage_s = 3.0;
  const LightPassages light(config, 200.0, 5);
  // Intervals are 5 to 15 s.
  REQUIRE(light.passages().size() >= 13);
  REQUIRE(light.passages().size() <= 40);
  std::size_t bright = 0;
  for (const auto& [begin_s, end_s, log_light] : light.passages()) {
    CHECK(end_s - begin_s == Approx(3.0));
    const double factor = light.factor(begin_s + 1.5);
    bright += factor > 1.0 ? 1U : 0U;
    CHECK(std::max(factor, 1.0 / factor) == Approx(8.0));
    CHECK(light.factor(begin_s - 1e-6) == 1.0);
    const double half = light.factor(begin_s + 0.5 * LightPassages::kRamp_s);
    CHECK(std::max(half, 1.0 / half) == Approx(std::sqrt(8.0)));
  }
  CHECK(bright > 0);
  CHECK(bright < light.passages().size());
  CHECK(LightPassages({}, 200.0, 5).passages().empty());
}

TEST_CASE("Light that doubles doubles grey levels until the exposure follows",
          "[simulation][exposure]") {
  const PixelRays rays(forward_camera(16, 16, 16.0));
  const SensorEffects effects(rays, clean_sensor());
  const RenderedView view = uniform_view(rays.camera(), 0.2F);
  Shot shot = plain_shot();
  CHECK(static_cast<int>(effects.gray(view, shot).pixels[40]) == 51);
  shot.light = 2.0;
  CHECK(static_cast<int>(effects.gray(view, shot).pixels[40]) == 102);
  ExposureControl control(clean_sensor(), 20.0), lit(clean_sensor(), 20.0);
  const double gain = control.next(view).gain;
  CHECK(lit.next(view, 2.0).gain == Approx(0.5 * gain).epsilon(1e-6));
  // 200 frames at 2 % leave 2 % of the way.
  for (int i = 0; i < 200; ++i) (void)control.next(view, 2.0);
  CHECK(control.next(view, 2.0).gain == Approx(0.5 * gain).epsilon(0.02));
}

TEST_CASE("Spots of dirt hide a share of the light in fixed places", "[simulation][clutter]") {
  const PixelRays rays(forward_camera(120, 80, 100.0));
  SensorEffectsConfig config = clean_sensor();
  config.dirt = 0.5;
  const auto levels = [&](std::uint64_t seed) {
    return SensorEffects(rays, config, seed)
        .gray(uniform_view(rays.camera(), 0.8F), plain_shot())
        .pixels;
  };
  const auto image = levels(1);
  const auto [darkest, brightest] = std::minmax_element(image.begin(), image.end());
  CHECK(static_cast<int>(*brightest) == 204);
  // Dirt sends 40 % of the mean light itself: 204 * (1 - 0.5 * 0.6) = 143 in the densest spot, and
  // spots have 40 % or more of this density.
  CHECK(static_cast<int>(*darkest) >= 143);
  CHECK(static_cast<int>(*darkest) <= 180);
  CHECK(levels(1) == image);
  CHECK(levels(2) != image);
}

TEST_CASE("A light before the lens lifts the whole image, one behind it does not",
          "[simulation][clutter]") {
  const PixelRays rays(forward_camera(120, 80, 100.0));
  SensorEffectsConfig config = clean_sensor();
  config.glare = 0.5;
  const SensorEffects effects(rays, config);
  const RenderedView view = uniform_view(rays.camera(), 0.2F);
  Shot shot = plain_shot();
  shot.lights = {{-Eigen::Vector3d::UnitX(), 0.8}};
  CHECK(effects.gray(view, shot).pixels == std::vector<std::uint8_t>(120 * 80, 51));
  shot.lights = {{Eigen::Vector3d::UnitX(), 0.8}};
  const auto lit = effects.gray(view, shot).pixels;
  // The least share of the veil is 0.3: 0.2 + 0.5 * 0.8 * 0.3 = 0.32, rounded to 82 levels.
  CHECK(static_cast<int>(*std::min_element(lit.begin(), lit.end())) >= 81);
  // The light and its ghosts are at the centre; the widest ghost has a radius of 8 px there.
  const auto brightest = std::max_element(lit.begin(), lit.end()) - lit.begin();
  CHECK(std::hypot(static_cast<double>(brightest % 120) - 59.5,
                   static_cast<double>(brightest / 120) - 39.5) < 8.0);
}

TEST_CASE("Rain before a resting camera makes vertical streaks", "[simulation][clutter]") {
  const PixelRays rays(forward_camera(160, 120, 150.0));
  SensorEffectsConfig config = clean_sensor();
  config.rain_drops = 300;
  const SensorEffects effects(rays, config);
  const RenderedView view = uniform_view(rays.camera(), 0.3F);
  Shot shot = plain_shot();
  shot.rain_seed = GENERATE(1U, 2U);
  const auto image = effects.gray(view, shot).pixels;
  std::size_t down = 0, across = 0;  // neighbours that both show a drop
  const auto wet = [&](std::size_t i) { return image[i] > 77; };  // a dry pixel has 76.5
  for (std::size_t i = 0; i + 161 < image.size(); ++i) {
    down += wet(i) && wet(i + 160) ? 1U : 0U;
    across += wet(i) && wet(i + 1) ? 1U : 0U;
  }
  CHECK(down > 20);
  CHECK(down > across);
  CHECK(effects.gray(view, shot).pixels == image);
  shot.rain_seed = 7;
  CHECK(effects.gray(view, shot).pixels != image);
}

TEST_CASE("A wall hides the sun and lamps behind it", "[simulation][clutter]") {
  Builder builder;
  builder.wall(5.0F, 2.0F, builder.material(SurfaceClass::kWall, 0.5F));
  builder.world().lighting.sun = 0.8F;
  builder.world().lighting.to_sun = Eigen::Vector3f::UnitX();
  builder.world().lighting.lamps = {{{2.0F, 0.0F, 0.0F}, 4.0F}};
  const World world = builder.build();
  const Renderer renderer(world);
  const auto behind_wall = renderer.visible_lights(SE3::Identity());
  REQUIRE(behind_wall.size() == 1);
  CHECK(behind_wall[0].irradiance == Approx(1.0));  // the lamp, at 2 m
  const auto turned =
      renderer.visible_lights(make_pose(so3_exp({0.0, 0.0, 0.5 * M_PI}), {0.0, 10.0, 0.0}));
  REQUIRE(turned.size() == 2);
  CHECK(turned[0].irradiance == Approx(0.8));
  CHECK((turned[0].to_light_body + Eigen::Vector3d::UnitY()).norm() < 1e-6);
}

}  // namespace km
