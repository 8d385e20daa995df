#include "apps/lab/simulation/rendering/renderer.hpp"
#include "modules/core/geometry/lie.hpp"
#include "test/apps/lab/simulation/rendering/small_world.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using small_world::Builder;
using small_world::distorted_camera;
using small_world::forward_camera;
using small_world::view_of;

const RenderRequest kEverything{true, true, true};

std::size_t pixel(const RenderedView& view, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) +
         static_cast<std::size_t>(x);
}

SE3 tilted_pose() {
  Vector6 xi;
  xi << 0.05, -0.1, 0.08, 0.2, -0.3, 0.4;
  return se3_exp(xi);
}

TEST_CASE("Depth of a plane is the analytic one in every pixel") {
  const bool distorted = GENERATE(false, true);
  CAPTURE(distorted);
  const Camera camera = distorted ? distorted_camera(78, 58, 48.0) : forward_camera(78, 58, 48.0);
  Builder builder;
  builder.wall(2.0F, 6.0F, builder.material(SurfaceClass::kWall, 0.5F));
  const World world = builder.build();
  const SE3 T_world_body = tilted_pose();
  const RenderedView view = view_of(world, camera, T_world_body, kEverything);

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

TEST_CASE("A box hides only the surfaces behind it") {
  const Camera camera = distorted_camera(62, 46, 40.0);
  Builder builder;
  builder.wall(8.0F, 3.0F, builder.material(SurfaceClass::kWall, 0.5F));
  builder.scene.box({4.0F, -0.5F, -0.25F}, {5.0F, 0.5F, 0.75F},
                    builder.material(SurfaceClass::kVehicle, 0.5F));
  const World world = builder.build();
  const RenderedView view = view_of(world, camera, SE3::Identity(), kEverything);
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

using small_world::at;

// Looks straight down from above the origin: the image's right is -y, its top is +x.
SE3 looking_down(double height_m) {
  Eigen::Matrix3d R;
  R << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  return make_pose(R, {0.0, 0.0, height_m});
}

TEST_CASE("A lamp lights by the square of its distance and casts shadows") {
  Builder builder;
  const MaterialId gray = builder.material(SurfaceClass::kFloor, 1.0F);
  builder.scene.quad({-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}, gray);
  builder.scene.box({1.0F, -5.0F, 0.0F}, {1.1F, 5.0F, 2.0F}, gray);  // hides x > 1 from the lamp
  builder.world().lighting.ambient = 0.0F;
  builder.world().lighting.lamps.push_back({{0.0F, 0.0F, 2.0F}, 4.0F});
  const World world = builder.build();
  const RenderedView view = view_of(world, forward_camera(96, 96, 60.0), looking_down(3.5));
  // Below the lamp: 4 / 2^2.
  CHECK(at(view, 48, 48) == Approx(1.0F).margin(0.03F));
  // Beyond the screen, seen over its top: nothing.
  CHECK(at(view, 48, 2) < 0.02F);
}

// Share of a pixel, centred at (x, y), right of the line x = x0 + slope * y, by many samples.
double share_right_of(double x0, double slope, int x, int y) {
  constexpr int kRows = 200;
  double sum = 0.0;
  for (int i = 0; i < kRows; ++i) {
    const double row = y - 0.5 + (i + 0.5) / kRows;
    sum += std::clamp(x + 0.5 - (x0 + slope * row), 0.0, 1.0);
  }
  return sum / kRows;
}

TEST_CASE("The grey of an edge is the share of the pixel that is covered") {
  const double slope = GENERATE(0.0, 0.13, -0.4, 0.9);
  CAPTURE(slope);
  const Camera camera = forward_camera(48, 48, 48.0);
  Builder builder;
  const MaterialId white = builder.material(SurfaceClass::kWall, 1.0F);
  const MaterialId black = builder.material(SurfaceClass::kObject, 0.0F);
  // A screen 1.5 m away whose edge is the image of x = x0 + slope * y; far to the right of it.
  const double x0 = 23.3 - slope * camera.cy;
  const auto on_screen = [&](double x, double y) {
    return Eigen::Vector3d(1.5, -1.5 * (x - camera.cx) / camera.fx,
                           -1.5 * (y - camera.cy) / camera.fy)
        .cast<float>()
        .eval();
  };
  const auto edge = [&](double y) { return on_screen(x0 + slope * y, y); };
  builder.scene.quad(edge(60.0), on_screen(100.0, 60.0), on_screen(100.0, -60.0), edge(-60.0),
                     white);
  builder.wall(5.0F, 4.0F, black);
  const World world = builder.build();
  const RenderedView view = view_of(world, camera, SE3::Identity());
  double squares = 0.0;
  int partial = 0;
  for (int y = 4; y < 44; ++y) {
    for (int x = 4; x < 44; ++x) {
      // The light of the screen's rim is interpolated: grey levels are shares of that beside the
      // edge.
      const double expected = share_right_of(x0, slope, x, y);
      const double white_level = static_cast<double>(at(view, 47, y));
      const double share = static_cast<double>(at(view, x, y)) / white_level;
      CAPTURE(x, y);
      REQUIRE(share == Approx(expected).margin(1.5 / 4.0));
      if (expected <= 0.0 || expected >= 1.0) continue;
      squares += (share - expected) * (share - expected);
      ++partial;
    }
  }
  REQUIRE(partial >= 40);
  // A pixel of which an edge cuts off less than a corner may go unnoticed.
  CHECK(std::sqrt(squares / partial) < 0.5 / 4.0);
}

// A floor with a random texture, seen at a grazing angle. All lengths are those of a street's a
// twentieth: light is baked for a small floor only.
constexpr double kScale = 0.05;

World textured_floor() {
  Builder builder;
  constexpr int kSize = 256;
  std::mt19937 random(5);
  std::vector<Eigen::Vector3f> texels;
  for (int i = 0; i < kSize * kSize; ++i)
    texels.emplace_back(Eigen::Vector3f::Constant((random() & 1U) != 0U ? 0.9F : 0.1F));
  builder.world().textures.emplace_back(kSize, texels);
  const MaterialId floor = builder.material(SurfaceClass::kRoad, 1.0F, 2);
  builder.world().materials[floor].base_period_m = static_cast<float>(kScale);
  builder.scene.quad({-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}, floor);
  return builder.build();
}

SE3 above_floor(double x, double y) {
  return make_pose(Eigen::Matrix3d::Identity(), kScale * Eigen::Vector3d(x, y, 1.5));
}

double row_deviation(const RenderedView& view, int row) {
  double sum = 0.0;
  double squares = 0.0;
  for (int x = 0; x < view.width; ++x) {
    const auto value = static_cast<double>(at(view, x, row));
    sum += value;
    squares += value * value;
  }
  const double mean = sum / view.width;
  return std::sqrt(std::max(0.0, squares / view.width - mean * mean));
}

TEST_CASE("A texture loses contrast with distance instead of aliasing") {
  const World world = textured_floor();
  const RenderedView view = view_of(world, forward_camera(320, 240, 200.0), above_floor(0.3, 0.2));
  // Rows at 2.5, 7 and 30 m, scaled: a pixel then covers 3, 9 and 38 texels across, more along the
  // view.
  const double near = row_deviation(view, 239);
  const double middle = row_deviation(view, 162);
  const double far = row_deviation(view, 129);
  CHECK(middle < 0.6 * near);
  CHECK(far < 0.5 * middle);
}

}  // namespace
}  // namespace km
