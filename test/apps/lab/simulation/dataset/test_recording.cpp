#include <catch2/catch.hpp>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "apps/lab/simulation/dataset/dataset_record.hpp"
#include "apps/lab/simulation/dataset/image_encoding.hpp"
#include "apps/lab/simulation/dataset/number_text.hpp"
#include "apps/lab/simulation/dataset/recording_files.hpp"
#include "apps/lab/simulation/dataset/recording_texts.hpp"
#include "apps/lab/simulation/world/scene.hpp"
#include "modules/core/json.hpp"
#include "modules/core/lie.hpp"
#include "modules/core/text_rows.hpp"
#include "modules/sensors/node/euroc_rig.hpp"
#include "test/support/image_file.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 31;  // no multiple of anything
constexpr int kHeight = 17;
constexpr std::size_t kPixels = 31 * 17;

template <typename T>
std::vector<T> random_values(std::uint32_t max, std::size_t count = kPixels) {
  std::mt19937 random(5);
  std::vector<T> values(count);
  for (T& value : values) value = static_cast<T>(random() % (max + 1));
  return values;
}

template <typename T>
std::vector<T> pixels_of(const cv::Mat& image) {
  REQUIRE(image.isContinuous());
  const T* const first = image.ptr<T>();
  return {first, first + image.total() * static_cast<std::size_t>(image.channels())};
}

TEST_CASE("PNG images come back as they were", "[simulation][dataset]") {
  SECTION("grey") {
    const auto pixels = random_values<std::uint8_t>(255);
    const auto bytes = encode_gray({kWidth, kHeight, pixels}, ImageFormat::kPng);
    const cv::Mat image = decoded(bytes, DecodedPixels::kStored);
    REQUIRE(image.type() == CV_8UC1);
    CHECK(pixels_of<std::uint8_t>(image) == pixels);
  }
  SECTION("depth, 16 bit") {
    const auto pixels = random_values<std::uint16_t>(65535);
    const cv::Mat image = decoded(encode_depth(kWidth, kHeight, pixels), DecodedPixels::kStored);
    REQUIRE(image.type() == CV_16UC1);
    CHECK(pixels_of<std::uint16_t>(image) == pixels);
  }
  SECTION("labels") {
    const auto pixels = random_values<LabelId>(17);
    const cv::Mat image = decoded(encode_labels(kWidth, kHeight, pixels), DecodedPixels::kStored);
    REQUIRE(image.type() == CV_8UC1);
    CHECK(pixels_of<std::uint8_t>(image) == pixels);
  }
  SECTION("colour, red first") {
    auto pixels = random_values<std::uint8_t>(255, 3 * kPixels);
    const cv::Mat image = decoded(encode_color(kWidth, kHeight, pixels, ImageFormat::kPng),
                                  DecodedPixels::kEightBits);
    const auto bgr = image.at<cv::Vec3b>(0, 1);
    CHECK(bgr[2] == pixels[3]);
    CHECK(bgr[1] == pixels[4]);
    CHECK(bgr[0] == pixels[5]);
  }
}

TEST_CASE("Equal images have equal bytes", "[simulation][dataset]") {
  const auto format = GENERATE(ImageFormat::kJpeg, ImageFormat::kPng);
  const GrayImage image{kWidth, kHeight, random_values<std::uint8_t>(255)};
  CHECK(encode_gray(image, format) == encode_gray(image, format));
}

TEST_CASE("JPEG keeps a smooth image to a grey level", "[simulation][dataset]") {
  GrayImage image{64, 48, {}};
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      image.pixels.push_back(static_cast<std::uint8_t>(40 + 2 * x + y));
  const cv::Mat near = decoded(encode_gray(image, ImageFormat::kJpeg), DecodedPixels::kStored);
  REQUIRE(near.type() == CV_8UC1);
  const auto pixels = pixels_of<std::uint8_t>(near);
  int largest = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i)
    largest = std::max(largest, std::abs(pixels[i] - image.pixels[i]));
  CHECK(largest <= 2);  // grey levels: quality 92 divides the lowest frequencies by 2 or 3
}

TEST_CASE("Images of the wrong size are refused", "[simulation][dataset]") {
  CHECK_THROWS_AS(encode_gray({4, 4, std::vector<std::uint8_t>(15)}, ImageFormat::kPng),
                  std::invalid_argument);
  CHECK_THROWS_AS(encode_gray({-4, -4, std::vector<std::uint8_t>(16)}, ImageFormat::kPng),
                  std::invalid_argument);
  CHECK_THROWS_AS(encode_depth(4, 4, std::vector<std::uint16_t>(17)), std::invalid_argument);
  CHECK_THROWS_AS(encode_labels(0, 0, {}), std::invalid_argument);
  CHECK_THROWS_AS(encode_color(2, 2, std::vector<std::uint8_t>(4), ImageFormat::kPng),
                  std::invalid_argument);
}

Camera some_camera(double shift_m) {
  Camera camera;
  camera.width = 376;
  camera.height = 240;
  camera.fx = 229.327;
  camera.fy = 228.648;
  camera.cx = 183.6075;
  camera.cy = 124.1875;
  camera.lens =
      Lens(LensModel::kRadialTangential, {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05});
  camera.T_body_cam = make_pose(so3_exp(Eigen::Vector3d(0.1, -1.2, 0.7)), {shift_m, -0.06, 1e-9});
  return camera;
}

void check_equal(const Camera& a, const Camera& b) {
  constexpr double kRounding = 1e-14;  // tolerance of the reader's nearest rotation
  CHECK(a.width == b.width);
  CHECK(a.height == b.height);
  // Focal lengths of calibrations with a xi are 1 + xi times as long.
  const bool exact =
      b.lens.model() == LensModel::kRadialTangential || b.lens.model() == LensModel::kEquidistant;
  CHECK(std::abs(a.fx - b.fx) <= (exact ? 0.0 : 1e-13));
  CHECK(std::abs(a.fy - b.fy) <= (exact ? 0.0 : 1e-13));
  CHECK(a.cx == b.cx);
  CHECK(a.cy == b.cy);
  CHECK(a.lens == b.lens);
  CHECK((a.T_body_cam.matrix() - b.T_body_cam.matrix()).norm() < kRounding);
}

TEST_CASE("The reader gets the calibration that was written", "[simulation][dataset]") {
  const TemporaryFolder folder;
  const RecordingLayout layout(folder.path(), ImageFormat::kJpeg);
  Camera left = some_camera(0.0);
  const Camera right = some_camera(0.11);
  left.lens = GENERATE(
      Lens(), Lens(LensModel::kRadialTangential, {-0.28340811, 0.07395907, 0.00019359, 1e-17}),
      Lens(LensModel::kRadialTangential, {-0.3, 0.1, 1e-3, 1e-3, 0.1 + 0.2}),
      Lens(LensModel::kRadialTangential, {0.4, 0.1, 1e-4, 2e-4, 0.01, 0.8, 0.3, 0.04}),
      Lens(LensModel::kEquidistant, {0.0034823894022493434, 7e-4, -2e-3, 2e-4}),
      Lens(LensModel::kOmnidirectional, {0.8, -0.3, 0.1, 1e-4, 2e-4}),
      Lens(LensModel::kDoubleSphere, {-0.17213086034353243, 0.6}));
  CAPTURE(to_string(left.lens.model()));
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
  const Camera camera = some_camera(0.0);
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

constexpr const char* kText = "all or nothing";

std::string refusal(const fs::path& file) {
  try {
    write_whole_file(file, std::string_view(kText));
  } catch (const RecordingError& error) {
    return error.what();
  }
  return {};
}

TEST_CASE("A file is written whole, and its folders are made", "[simulation][dataset]") {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "a/b/data.csv";
  write_whole_file(file, std::string_view(kText));
  CHECK(folder.read("a/b/data.csv") == kText);
  write_whole_file(file, std::string_view("again"));
  CHECK(folder.read("a/b/data.csv") == "again");
  CHECK(std::distance(fs::directory_iterator(file.parent_path()), {}) == 1);
}

TEST_CASE("A full disk is named with its file and leaves no file behind", "[simulation][dataset]") {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "image.jpg";
  fs::create_symlink("/dev/full", file.string() + ".part");  // every write fails with ENOSPC
  const std::string message = refusal(file);
  CAPTURE(message);
  CHECK_THAT(message, Catch::Contains(file.string()) && Catch::Contains("No space left") &&
                          Catch::Contains("same command"));
  CHECK(fs::is_empty(folder.path()));
}

TEST_CASE("A full disk leaves the file that was there", "[simulation][dataset]") {
  const TemporaryFolder folder;
  const fs::path file = folder.write("table.csv", "old");
  fs::create_symlink("/dev/full", file.string() + ".part");
  CHECK_FALSE(refusal(file).empty());
  CHECK(folder.read("table.csv") == "old");
}

TEST_CASE("A recording whose place cannot be written names it", "[simulation][dataset]") {
  const TemporaryFolder folder;
  const fs::path file = folder.write("file", "") / "below/data.csv";
  CHECK_THAT(refusal(file), Catch::Contains(folder.path().string() + "/file"));
}

TEST_CASE("A truncated image is not whole", "[simulation][dataset]") {
  const auto format = GENERATE(ImageFormat::kJpeg, ImageFormat::kPng);
  const TemporaryFolder folder;
  const fs::path file = folder.path() / ("image" + extension(format));
  GrayImage image{16, 16, std::vector<std::uint8_t>(256, 77)};
  auto bytes = encode_gray(image, format);
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

TEST_CASE("The world's mesh is written with classes and their colours", "[simulation][dataset]") {
  const World world = two_triangles();
  const LabelPalette& palette = simulation_palette();
  const auto bytes = world_ply(world, palette);
  const std::string text(bytes.begin(), bytes.end());
  const std::string end = "end_header\n";
  const std::size_t body = text.find(end) + end.size();
  CHECK_THAT(text.substr(0, body), Catch::StartsWith("ply\nformat binary_little_endian 1.0\n") &&
                                       Catch::Contains("element vertex 3\n") &&
                                       Catch::Contains("element face 2\n") &&
                                       Catch::Contains("property uchar label\n"));
  REQUIRE(bytes.size() == body + 3 * 12 + 2 * 17);
  CHECK(value_at<float>(bytes, body + 12) == 4.0F);
  CHECK(value_at<float>(bytes, body + 32) == 9.0F);

  const std::size_t face = body + 36;
  CHECK(value_at<std::uint8_t>(bytes, face) == 3);
  CHECK(value_at<std::int32_t>(bytes, face + 9) == 2);
  const auto building = static_cast<LabelId>(SurfaceClass::kBuilding);
  CHECK(value_at<std::uint8_t>(bytes, face + 13) == building);
  for (std::size_t i = 0; i < 3; ++i)
    CHECK(value_at<std::uint8_t>(bytes, face + 14 + i) == palette.find(building)->color[i]);
  CHECK(value_at<std::uint8_t>(bytes, face + 17 + 13) == static_cast<LabelId>(SurfaceClass::kRoad));
}

TEST_CASE("The world's objects are written with their classes and boxes", "[simulation][dataset]") {
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

const DatasetRecord kRecord = {
    "simulator 1", {{"world", "city"}, {"duration", "30"}}, {"robot0"}, false};

TEST_CASE("The record has all parameters that a run depends on", "[simulation][dataset]") {
  CHECK(to_json(kRecord) ==
        "{\n  \"generator\": \"simulator 1\",\n  \"parameters\": {\n    \"world\": \"city\",\n"
        "    \"duration\": \"30\"\n  },\n  \"finished_robots\": [\n    \"robot0\"\n  ],\n"
        "  \"complete\": false\n}\n");
}

TEST_CASE("Records differ by parameters and program, not by the finished robots",
          "[simulation][dataset]") {
  DatasetRecord wanted = kRecord;
  wanted.finished_robots.clear();
  CHECK(differences(kRecord, wanted).empty());
  SECTION("another value") {
    wanted.parameters[1].second = "60";
    CHECK(differences(kRecord, wanted) ==
          std::vector<std::string>{"duration: 30 there, 60 asked for"});
  }
  SECTION("a parameter that only the folder has") {
    wanted.parameters.pop_back();
    CHECK(differences(kRecord, wanted) ==
          std::vector<std::string>{"duration: 30 there, not set asked for"});
  }
  SECTION("a parameter that only the run has") {
    wanted.parameters.emplace_back("seed", "2");
    CHECK(differences(kRecord, wanted) ==
          std::vector<std::string>{"seed: not set there, 2 asked for"});
  }
  SECTION("another program, first") {
    wanted.generator = "simulator 2";
    wanted.parameters[0].second = "camp";
    CHECK(differences(kRecord, wanted) ==
          std::vector<std::string>{"generator: simulator 1 there, simulator 2 asked for",
                                   "world: city there, camp asked for"});
  }
}

}  // namespace
}  // namespace km
