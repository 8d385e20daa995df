#include "apps/lab/simulation/rendering/sensor_effects.hpp"
#include "apps/lab/simulation/rendering/surfaces.hpp"
#include "apps/lab/simulation/world/objects.hpp"
#include "modules/core/geometry/lie.hpp"
#include "test/apps/lab/simulation/rendering/small_world.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using small_world::at;
using small_world::Builder;
using small_world::distorted_camera;
using small_world::forward_camera;

RenderedView flat_view(const Camera& camera, float radiance) {
  RenderedView view;
  view.width = camera.width;
  view.height = camera.height;
  const auto n = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  view.radiance.assign(n, radiance);
  view.depth_m.assign(n, 2.0F);
  return view;
}

TEST_CASE("The exposure starts at its target and follows a change of light with a lag") {
  constexpr double kTarget = 0.55;
  const SensorEffectsConfig config;
  ExposureControl control(config, 20.0);
  CHECK(control.next(flat_view(forward_camera(8, 8, 8.0), 0.8F)).gain * 0.8 ==
        Approx(kTarget).epsilon(1e-3));
  const RenderedView dark = flat_view(forward_camera(8, 8, 8.0), 0.1F);
  double last = 0.0;
  for (int i = 0; i < 400; ++i) {
    const Exposure exposure = control.next(dark);
    const double level = exposure.gain * 0.1;
    CHECK(level > last);  // no overshoot
    CHECK(exposure.time_s ==
          Approx(std::min(exposure.gain * config.unit_exposure_s, config.max_exposure_s)));
    if (i == 0) CHECK(level < 0.3 * kTarget);
    last = level;
  }
  CHECK(last == Approx(kTarget).epsilon(0.01));
}

Shot shot(double gain, std::uint64_t seed = 0) {
  Shot result;
  result.exposure = {gain, 0.01};
  result.noise_seed = seed;
  return result;
}

TEST_CASE("Noise has the strength and the correlation of the sensor") {
  const double level = GENERATE(0.1, 0.5, 0.8);
  CAPTURE(level);
  const Camera camera = forward_camera(640, 480, 400.0);
  const SensorEffects effects(PixelRays(camera), {});
  const GrayImage image = effects.gray(flat_view(camera, static_cast<float>(level)), shot(1.0, 7));
  // The middle, where vignetting is below 1 %.
  double count = 0.0, sum = 0.0, squares = 0.0, products = 0.0;
  for (int y = 200; y < 280; ++y) {
    for (int x = 270; x < 370; ++x) {
      const std::uint8_t* const pixel = &image.pixels[static_cast<std::size_t>(y * 640 + x)];
      const double here = pixel[0] - 255.0 * level, next = pixel[1] - 255.0 * level;
      count += 1.0;
      sum += here;
      squares += here * here;
      products += here * next;
    }
  }
  // Read noise of 1 and photon noise of 2 levels; rounding to whole levels adds a variance of 1/12.
  CHECK(std::abs(sum / count) < 1.5);
  CHECK(std::sqrt(squares / count) ==
        Approx(std::sqrt(1.0 + 4.0 * level + 1.0 / 12.0)).epsilon(0.2));
  // White noise smoothed by a Gaussian of 1.2 px: exp(-1 / (4 * 1.2^2)) one pixel on.
  CHECK(products / squares == Approx(0.84).margin(0.15));
  CHECK(effects.gray(flat_view(camera, static_cast<float>(level)), shot(1.0, 8)).pixels !=
        image.pixels);
}

// Light of an image, and its centre of mass relative to the pixel `center`.
struct LightMoments {
  double mass = 0.0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
};

LightMoments moments_of(const std::vector<float>& image, int width, const Eigen::Vector2d& center) {
  LightMoments m;
  for (std::size_t i = 0; i < image.size(); ++i) {
    const int k = static_cast<int>(i);
    const auto value = static_cast<double>(image[i]);
    const Eigen::Vector2d d = Eigen::Vector2d(k % width, k / width) - center;
    m.mass += value;
    m.mean += value * d;
    m.spread += value * d * d.transpose();
  }
  return m;
}

TEST_CASE("Image motion equals that of projected points") {
  const Camera camera = distorted_camera(188, 120, 115.0);
  const PixelRays rays(camera);
  Vector6 velocity;
  velocity << 0.4, -0.9, 0.6, 1.5, -0.7, 0.3;
  const double depth = GENERATE(0.7, 4.0, 0.0);
  CAPTURE(depth);
  const std::vector<float> depths(188 * 120, static_cast<float>(depth));
  const std::vector<Eigen::Vector2f> motion = image_motion(rays, depths, velocity, 0.01);
  for (const Eigen::Vector2i& pixel : {Eigen::Vector2i(5, 9), {94, 60}, {180, 30}, {100, 112}}) {
    const double z = depth > 0.0 ? depth : 1e6;
    const Eigen::Vector3d point = z * camera.unproject(pixel.cast<double>()).value().homogeneous();
    const auto seen_at = [&](double t) {
      const SE3 T_start_body = se3_exp(t * velocity);
      const SE3 T_cam_start = (T_start_body * camera.T_body_cam).inverse() * camera.T_body_cam;
      return camera.project((T_cam_start * point).hnormalized()).value();
    };
    const Eigen::Vector2d expected = seen_at(0.005) - seen_at(-0.005);
    const std::size_t i = static_cast<std::size_t>(pixel.y() * 188 + pixel.x());
    CAPTURE(pixel.transpose(), expected.transpose());
    // A finite difference of the lens stands in for its derivative: 1 % near the corners.
    CHECK((motion[i].cast<double>() - expected).norm() < 0.02 * expected.norm() + 1e-3);
  }
}

TEST_CASE("A bright point is smeared along its motion, its light kept") {
  constexpr int kWidth = 61;
  constexpr int kHeight = 41;
  std::vector<float> image(kWidth * kHeight, 0.0F);
  image[20 * kWidth + 30] = 1.0F;
  const Eigen::Vector2f motion(9.0F, 6.0F);
  const std::vector<float> result =
      blurred(image, kWidth, kHeight, std::vector<Eigen::Vector2f>(image.size(), motion));
  const auto [mass, mean, spread] = moments_of(result, kWidth, {30, 20});
  CHECK(mass == Approx(1.0).margin(0.02));
  CHECK(mean.norm() < 0.01);
  // A segment of length L has the variance L^2 / 12 along it; bilinear taps add about 1/6 px^2.
  const Eigen::Vector2d along = motion.cast<double>().normalized();
  const Eigen::Vector2d across(-along.y(), along.x());
  CHECK(along.dot(spread * along) == Approx(motion.squaredNorm() / 12.0 + 0.17).epsilon(0.1));
  CHECK(across.dot(spread * across) < 0.3);
}

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

TEST_CASE("A rolling shutter shears a vertical edge by rate * focal length * time of a row") {
  const World world = edge_world();
  const Renderer renderer(world);
  const Camera camera = forward_camera(120, 80, 100.0);
  SensorEffectsConfig config{.rolling_shutter_s = 0.04};
  const double rate_rps = GENERATE(1.5, -1.5);
  std::vector<SE3> poses;
  for (int row = 0; row < camera.height; ++row)
    poses.push_back(turned_left(rate_rps * row_delay_s(config, row, camera.height)));
  const RenderedView view = renderer.render(PixelRays(camera), poses, {});
  const double shear_px = rate_rps * camera.fx * config.rolling_shutter_s / camera.height;
  for (const int row : {5, 20, 60, 75}) {
    CAPTURE(row, rate_rps);
    // A pixel has five samples, 0, 1/8 and 3/8 px from its centre on both sides. They count an edge
    // with an error of at most 0.175 px; the tangent of 0.03 rad adds 0.001 px.
    CHECK(edge_px(view, row) == Approx(60.0 + shear_px * (row + 0.5 - 40.0)).margin(0.18));
  }
}

TEST_CASE("A moved car is at its pose in the images of labels and depth") {
  Builder builder;
  builder.wall(30.0F, 60.0F, builder.material(SurfaceClass::kWall, 0.5F));
  const World world = builder.build();
  const Renderer renderer(world);
  Scene scene;
  SeededRandom random(3);
  add_prop(scene, Prop::kHatchback, random);
  World shapes;
  scene.move_to(shapes);
  const SE3 T_world_car =
      make_pose(so3_exp({0.0, 0.0, GENERATE(0.0, 0.7, 2.5)}), {GENERATE(8.0, 14.0), 1.0, -1.2});
  const MovedSurfaces moved(shapes, std::vector<SE3>{T_world_car});
  const PixelRays rays(forward_camera(160, 120, 140.0));
  const std::vector<SE3> poses = {SE3::Identity()};
  const RenderRequest request{true, true, true};
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
  constexpr auto kVehicle = static_cast<LabelId>(SurfaceClass::kVehicle);
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < with.labels.size(); ++i) {
    wrong += without.labels[i] == kVehicle ? 1 : 0;
    if (with.labels[i] != kVehicle) {
      wrong += with.depth_m[i] == without.depth_m[i] ? 0 : 1;
      continue;
    }
    seen.extend(Eigen::Vector2d(static_cast<double>(i % 160), static_cast<double>(i / 160)));
    depth_m = std::min(depth_m, with.depth_m[i]);
  }
  CHECK(wrong == 0);
  REQUIRE_FALSE(seen.isEmpty());
  // A pixel belongs to the car if its centre does; corners narrower than a pixel may be missed.
  CHECK((seen.min() - projected.min()).cwiseAbs().maxCoeff() < 1.5);
  CHECK((seen.max() - projected.max()).cwiseAbs().maxCoeff() < 1.5);
  CHECK(depth_m > nearest_m - 1e-4F);
  CHECK(depth_m < nearest_m + 0.3F);
}

TEST_CASE("Passages multiply the light by the factor or its inverse") {
  SensorEffectsConfig config{.passage_light = 8.0, .passage_every_s = 10.0};
  const LightPassages light(config, 200.0, 5);
  int bright = 0, dark = 0, none = 0;
  for (double t_s = 0.0; t_s < 200.0; t_s += 0.01) {
    const double factor = light.factor(t_s);
    CHECK(std::max(factor, 1.0 / factor) < 8.0 + 1e-9);
    bright += factor > 7.9 ? 1 : 0;
    dark += factor < 1.0 / 7.9 ? 1 : 0;
    none += factor == 1.0 ? 1 : 0;
  }
  // 13 to 40 passages of 3 s with ramps of 0.4 s at both ends.
  CHECK(bright > 200);
  CHECK(dark > 200);
  CHECK(bright + dark > 13 * 220);
  CHECK(none > 20000 - 40 * 300);
  CHECK(LightPassages({}, 200.0, 5).factor(50.0) == 1.0);
}

TEST_CASE("A light before the lens lifts the whole image, one behind it does not") {
  const PixelRays rays(forward_camera(120, 80, 100.0));
  SensorEffectsConfig config{.glare = 0.5};
  const SensorEffects effects(rays, config);
  const RenderedView view = flat_view(rays.camera(), 0.2F);
  Shot exposed = shot(1.0);
  const auto without = effects.gray(view, exposed).pixels;
  exposed.lights = {{-Eigen::Vector3d::UnitX(), 0.8}};
  CHECK(effects.gray(view, exposed).pixels == without);
  exposed.lights = {{Eigen::Vector3d::UnitX(), 0.8}};
  const auto lit = effects.gray(view, exposed).pixels;
  // The least share of the veil is 0.3: 0.5 * 0.8 * 0.3 = 0.12 or 30 levels, 80 % of it in a
  // corner.
  for (std::size_t i = 0; i < lit.size(); ++i) CHECK(lit[i] - without[i] >= 20);
  // The light and its ghosts are at the centre; the widest ghost has a radius of 8 px there.
  const auto brightest = std::max_element(lit.begin(), lit.end()) - lit.begin();
  CHECK(std::hypot(static_cast<double>(brightest % 120) - 59.5,
                   static_cast<double>(brightest / 120) - 39.5) < 8.0);
}

TEST_CASE("A wall hides the sun and lamps behind it") {
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

}  // namespace
}  // namespace km
