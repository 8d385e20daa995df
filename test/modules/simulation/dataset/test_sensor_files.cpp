#include <catch2/catch.hpp>
#include <filesystem>

#include "modules/core/lie.hpp"
#include "modules/core/text_rows.hpp"
#include "modules/sensors/euroc_rig.hpp"
#include "modules/simulation/dataset/number_text.hpp"
#include "modules/simulation/dataset/recording_layout.hpp"
#include "modules/simulation/dataset/sensor_tables.hpp"
#include "modules/simulation/dataset/sensor_yaml.hpp"
#include "modules/simulation/dataset/whole_file.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

PinholeCamera some_camera(double shift_m) {
  PinholeCamera camera;
  camera.width = 376;
  camera.height = 240;
  camera.fx = 229.327;
  camera.fy = 228.648;
  camera.cx = 183.6075;
  camera.cy = 124.1875;
  camera.distortion = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  camera.T_body_cam = make_pose(so3_exp(Eigen::Vector3d(0.1, -1.2, 0.7)), {shift_m, -0.06, 1e-9});
  return camera;
}

void check_equal(const PinholeCamera& a, const PinholeCamera& b) {
  constexpr double kRounding = 1e-14;  // of the reader's nearest rotation
  CHECK(a.width == b.width);
  CHECK(a.height == b.height);
  CHECK(a.fx == b.fx);
  CHECK(a.fy == b.fy);
  CHECK(a.cx == b.cx);
  CHECK(a.cy == b.cy);
  CHECK(a.distortion == b.distortion);
  CHECK((a.T_body_cam.matrix() - b.T_body_cam.matrix()).norm() < kRounding);
}

}  // namespace

TEST_CASE("The reader gets the calibration that was written", "[simulation][dataset]") {
  const TemporaryFolder folder;
  const RecordingLayout layout(folder.path(), ImageFormat::kJpeg);
  const PinholeCamera left = some_camera(0.0);
  const PinholeCamera right = some_camera(0.11);
  ImuNoise noise;
  noise.gyro_noise_density = 1.6968e-04;
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
}

TEST_CASE("The reader gets the depth camera that was written", "[simulation][dataset]") {
  const TemporaryFolder folder;
  const RecordingLayout layout(folder.path(), ImageFormat::kJpeg);
  const PinholeCamera camera = some_camera(0.0);
  const DepthCameraFigures figures{5.0, 0.4, 20.0, 0.27};
  write_whole_file(layout.calibration(ImageChannel::kLeft), camera_yaml(camera, 20.0, "left"));
  write_whole_file(layout.calibration(ImageChannel::kDepth), depth_yaml(camera, figures, "depth"));
  write_whole_file(layout.imu() / "sensor.yaml", imu_yaml({}, "simulated"));

  const SensorRig rig = read_euroc_rig(layout.mav0());
  CHECK(rig.stereo.depth_source == DepthSource::kDepthImage);
  CHECK(rig.stereo.baseline_m() == Approx(figures.baseline_m));
  REQUIRE(rig.depth);
  CHECK(rig.depth->min_m == figures.min_range_m);
  CHECK(rig.depth->max_m == figures.max_range_m);
  CHECK(read_depth_scale(layout.mav0()) == 0.001);
}

TEST_CASE("Numbers in tables read back as the same doubles", "[simulation][dataset]") {
  const ImuSample sample{1000005000000, {1.0 / 3.0, -2e-17, 5e8}, {9.81, 0.0, -0.1 - 0.2}};
  const std::string text = imu_csv({sample});
  const auto rows = split_rows(text);
  REQUIRE(rows.size() == 1);  // the header is a comment
  REQUIRE(rows[0].fields.size() == 7);
  CHECK(parse_int64(rows[0].fields[0]) == sample.stamp);
  for (int i = 0; i < 3; ++i) {
    const auto column = static_cast<std::size_t>(i);
    CHECK(parse_double(rows[0].fields[1 + column]) == sample.gyro[i]);
    CHECK(parse_double(rows[0].fields[4 + column]) == sample.accel[i]);
  }
}

TEST_CASE("A true state has EuRoC's columns", "[simulation][dataset]") {
  TrueState state;
  state.stamp = 7;
  state.T_world_body = make_pose(so3_exp(Eigen::Vector3d(0, 0, M_PI / 2)), {1, 2, 3});
  state.velocity_world = {4, 5, 6};
  state.gyro_bias = {7, 8, 9};
  state.accel_bias = {10, 11, 12};
  const std::string text = state_csv({state});
  const auto rows = split_rows(text);
  REQUIRE(rows.size() == 1);
  REQUIRE(rows[0].fields.size() == 17);
  std::vector<double> values;
  for (const auto& field : rows[0].fields) values.push_back(parse_double(field).value());
  CHECK(std::vector(values.begin(), values.begin() + 4) == std::vector<double>{7, 1, 2, 3});
  CHECK(values[4] == Approx(std::sqrt(0.5)));  // w
  CHECK(values[7] == Approx(std::sqrt(0.5)));  // z
  CHECK(std::vector(values.begin() + 8, values.end()) ==
        std::vector<double>{4, 5, 6, 7, 8, 9, 10, 11, 12});
}

TEST_CASE("Lists name the files that are there", "[simulation][dataset]") {
  const RecordingLayout layout("robot0", ImageFormat::kJpeg);
  CHECK(layout.image(ImageChannel::kRight, 42) == "robot0/mav0/cam1/data/42.jpg");
  CHECK(layout.image(ImageChannel::kDepth, 42) == "robot0/mav0/depth0/data/42.png");
  CHECK(layout.image(ImageChannel::kLabels, 42) == "robot0/mav0/label0/data/42.png");
  CHECK(layout.list(ImageChannel::kColor) == "robot0/mav0/color0/data.csv");
  CHECK(image_csv({41, 42}, ".png") == "#timestamp [ns],filename\n41,41.png\n42,42.png\n");
}

TEST_CASE("Numbers are as short as they can be", "[simulation][dataset]") {
  CHECK(number_text(20.0) == "20");
  CHECK(number_text(0.1) == "0.1");
  CHECK(parse_double(number_text(1.0 / 3.0)) == 1.0 / 3.0);
}

}  // namespace km
