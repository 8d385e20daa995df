#include <nlohmann/json.hpp>

#include "apps/lab/simulation/dataset/recording.hpp"
#include "apps/lab/simulation/world/scene.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/core/io/json.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

Camera some_camera(double shift_m) {
  Camera camera{
      .width = 376, .height = 240, .fx = 229.327, .fy = 228.648, .cx = 183.6075, .cy = 124.1875};
  camera.lens =
      Lens(LensModel::kRadialTangential, {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05});
  camera.T_body_cam = make_pose(so3_exp(Eigen::Vector3d(0.1, -1.2, 0.7)), {shift_m, -0.06, 1e-9});
  return camera;
}

void check_equal(const Camera& a, const Camera& b) {
  constexpr double kRounding = 1e-14;  // tolerance of the reader's nearest rotation
  CHECK(a.width == b.width);
  CHECK(a.height == b.height);
  CHECK(a.fx == b.fx);
  CHECK(a.fy == b.fy);
  CHECK(a.cx == b.cx);
  CHECK(a.cy == b.cy);
  CHECK(a.lens == b.lens);
  CHECK((a.T_body_cam.matrix() - b.T_body_cam.matrix()).norm() < kRounding);
}

TEST_CASE("The reader gets the calibration that was written") {
  const TemporaryFolder folder;
  const RecordingLayout layout(folder.path());
  const Camera left = some_camera(0.0), right = some_camera(0.11);
  ImuNoise noise{.gyro_noise_density = 1.6968e-04};
  noise.accel_random_walk = 0.1 + 0.2;  // needs all digits
  write_whole_file(layout.calibration(ImageChannel::kLeft), camera_yaml(left, 20.0, "left"));
  write_whole_file(layout.calibration(ImageChannel::kRight), camera_yaml(right, 20.0, "right"));
  write_whole_file(layout.imu() / "sensor.yaml", imu_yaml(noise, "simulated"));

  const SensorRig rig = read_euroc_rig(layout.mav0());
  check_equal(rig.stereo.cameras[0], left);
  check_equal(rig.stereo.cameras[1], right);
  CHECK(rig.imu.gyro_noise_density == noise.gyro_noise_density);
  CHECK(rig.imu.gyro_random_walk == noise.gyro_random_walk);
  CHECK(rig.imu.accel_noise_density == noise.accel_noise_density);
  CHECK(rig.imu.accel_random_walk == noise.accel_random_walk);
  CHECK(rig.imu.rate_hz == noise.rate_hz);

  const DepthCameraFigures figures{5.0, 0.4, 20.0, 0.27};
  fs::remove_all(layout.mav0() / "cam1");
  write_whole_file(layout.calibration(ImageChannel::kDepth), depth_yaml(left, figures, "depth"));
  const SensorRig rgbd = read_euroc_rig(layout.mav0());
  CHECK(rgbd.stereo.depth_source == DepthSource::kDepthImage);
  CHECK(rgbd.stereo.baseline_m() == Approx(figures.baseline_m));
  REQUIRE(rgbd.depth);
  CHECK(rgbd.depth->min_m == figures.min_range_m);
  CHECK(rgbd.depth->max_m == figures.max_range_m);
  CHECK(read_depth_scale(layout.mav0()) == 0.001);
}

TEST_CASE("A truncated image is not whole") {
  const bool jpeg = GENERATE(true, false);
  const TemporaryFolder folder;
  const fs::path file = folder.path() / (jpeg ? "image.jpg" : "image.png");
  auto bytes = jpeg ? encode_gray({16, 16, std::vector<std::uint8_t>(256, 77)})
                    : encode_depth(16, 16, std::vector<std::uint16_t>(256, 777));
  CHECK_FALSE(is_whole_image(file));
  write_whole_file(file, bytes);
  CHECK(is_whole_image(file));
  bytes.pop_back();
  write_whole_file(file, bytes);
  CHECK_FALSE(is_whole_image(file));
  write_whole_file(file, std::string_view());
  CHECK_FALSE(is_whole_image(file));
}

template <typename T>
T value_at(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  T value;
  REQUIRE(at + sizeof(T) <= bytes.size());
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

// Two triangles on three vertices, of two classes.
World two_triangles() {
  World world;
  world.mesh.vertices = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  world.mesh.triangles = {{0, 1, 2}, {2, 1, 0}};
  world.mesh.materials = {1, 0};
  world.materials.resize(2);
  world.materials[0].label = SurfaceClass::kRoad;
  world.materials[1].label = SurfaceClass::kBuilding;
  return world;
}

TEST_CASE("The world's mesh is written with classes and their colours") {
  const World world = two_triangles();
  const LabelPalette& palette = simulation_palette();
  const auto bytes = world_ply(world, palette);
  const std::string text(bytes.begin(), bytes.end());
  const std::string end = "end_header\n";
  const std::size_t body = text.find(end) + end.size();
  CHECK_THAT(text.substr(0, body), StartsWith("ply\nformat binary_little_endian 1.0\n") &&
                                       Contains("element vertex 3\n") &&
                                       Contains("element face 2\n") &&
                                       Contains("property uchar label\n"));
  REQUIRE(bytes.size() == body + 3 * 12 + 2 * 17);
  CHECK(value_at<float>(bytes, body + 12) == 4.0F);
  CHECK(value_at<float>(bytes, body + 32) == 9.0F);

  const std::size_t face = body + 36;
  CHECK(value_at<std::uint8_t>(bytes, face) == 3);
  CHECK(value_at<std::int32_t>(bytes, face + 9) == 2);
  const auto building = static_cast<LabelId>(SurfaceClass::kBuilding);
  CHECK(value_at<std::uint8_t>(bytes, face + 13) == building);
  CHECK(value_at<std::uint8_t>(bytes, face + 14) == palette.find(building)->color[0]);
  CHECK(value_at<std::uint8_t>(bytes, face + 17 + 13) == static_cast<LabelId>(SurfaceClass::kRoad));
}

TEST_CASE("The world's objects are written with their classes and boxes") {
  Scene scene;
  const auto paint = scene.plain(SurfaceClass::kVehicle, {1, 1, 1});
  const auto ground = scene.plain(SurfaceClass::kRoad, {1, 1, 1});
  scene.box({-9, -9, -1}, {9, 9, 0}, ground);
  {
    const auto frame = scene.at({3, 4, 0}, 0.5F);
    const Scene::Object object(scene);
    scene.box({-2, -1, 0}, {2, 1, 1}, paint);
    const auto roof = scene.at({0, 0, 1}, 1.0F);
    const Scene::Object part(scene);
    scene.box({-0.1F, -0.1F, 0}, {0.1F, 0.1F, 1}, paint);
    scene.box({-0.1F, -0.1F, 1}, {0.1F, 0.1F, 2}, ground);
  }
  World world;
  scene.move_to(world);
  const Json json = Json::parse(true_objects_json(world, simulation_palette()));
  REQUIRE(json["objects"].size() == 1);
  const Json& object = json["objects"][0];
  CHECK(object["class"] == "vehicle");
  CHECK(object["yaw_rad"].get<double>() == Approx(0.5));
  const auto is_near = [](const Json& values, const std::vector<double>& wanted) {
    for (std::size_t i = 0; i < 3; ++i)
      CHECK(values[i].get<double>() == Approx(wanted[i]).margin(1e-5));
  };
  is_near(object["center_m"], {3, 4, 1});
  is_near(object["size_m"], {4, 2, 2});
}

}  // namespace
}  // namespace km
