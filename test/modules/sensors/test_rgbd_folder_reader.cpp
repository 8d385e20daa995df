#include "modules/sensors/rgbd_folder_reader.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "modules/core/depth_lookup.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// Four frames, numbers 0, 2, 4, 6, of 8x6 px: grey 10 * number, depth 1000 + number mm, the camera
// number / 10 m along x.
class RgbdFolder {
 public:
  RgbdFolder() {
    std::string poses = "# frame and pose\n";
    for (const int number : {0, 2, 4, 6}) {
      const std::uint8_t grey = static_cast<std::uint8_t>(10 * number);
      write_image(name(number, ".color.png"), cv::Mat(6, 8, CV_8UC3, cv::Scalar::all(grey)));
      write_image(name(number, ".depth.png"), cv::Mat(6, 8, CV_16UC1, cv::Scalar(1000 + number)));
      poses +=
          std::to_string(number) + " 1 0 0 " + std::to_string(0.1 * number) + " 0 1 0 0  0 0 1 0\n";
    }
    write("poses.txt", poses);
    write("camera-intrinsics.txt", "10.0 0 4.0\n0 11.0 3.0\n0 0 1\n");
  }

  static std::string name(int number, const std::string& ending) {
    return "frame-00000" + std::to_string(number) + ending;
  }
  const fs::path& path() const { return folder_.path(); }
  void write(const std::string& file, const std::string& text) const {
    (void)folder_.write(file, text);
  }
  void write_image(const std::string& file, const cv::Mat& pixels) const {
    cv::imwrite((path() / file).string(), pixels);
  }

 private:
  TemporaryFolder folder_;
};

std::vector<PosedFrame> read_all(RgbdFolderReader& reader) {
  std::vector<PosedFrame> frames;
  while (auto frame = reader.next()) frames.push_back(std::move(*frame));
  return frames;
}

TEST_CASE("An RGB-D folder gives grey, depth and pose of every frame", "[sensors]") {
  const RgbdFolder folder;
  RgbdFolderReader reader(folder.path(), {.rate_hz = 20.0});
  CHECK(reader.frame_count() == 4);
  CHECK(reader.rig().depth_source == DepthSource::kDepthImage);
  CHECK(reader.rig().cameras[0].width == 8);
  CHECK(reader.rig().cameras[0].fy == 11.0);
  const auto frames = read_all(reader);
  REQUIRE(frames.size() == 4);
  CHECK(reader.report().empty());
  for (std::size_t i = 0; i < 4; ++i) {
    const auto number = static_cast<int>(2 * i);
    const StereoFrame& frame = *frames[i].frame;
    CHECK(frame.stamp == number * 50'000'000);
    CHECK(fits(frame, reader.rig()));
    CHECK(frame.left.pixels[7] == 10 * number);
    REQUIRE(frame.depth != nullptr);
    CHECK(frame.depth->millimetres[47] == 1000 + number);
    CHECK(frames[i].T_world_cam.translation().x() == Approx(0.1 * number));
  }
}

TEST_CASE("A pose may have a file of its own", "[sensors]") {
  const RgbdFolder folder;
  fs::remove(folder.path() / "poses.txt");
  const auto write_pose = [&](int number, const std::string& last) {
    folder.write(RgbdFolder::name(number, ".pose.txt"),
                 "0 -1 0 5\n1 0 0 6\n0 0 1 " + last + "\n0 0 0 1\n");
  };
  write_pose(0, "7");
  write_pose(2, "nan");
  write_pose(4, "eight");
  RgbdFolderReader reader(folder.path());
  const auto frames = read_all(reader);
  REQUIRE(frames.size() == 1);
  CHECK(frames[0].T_world_cam.translation() == Eigen::Vector3d(5, 6, 7));
  CHECK(frames[0].T_world_cam.linear() * Eigen::Vector3d::UnitX() == Eigen::Vector3d::UnitY());
  CHECK(reader.report().count(ReaderFault::kWithoutPose) == 3);
  CHECK_THAT(reader.report().entries().at(ReaderFault::kWithoutPose).first,
             Catch::EndsWith("frame-000002.pose.txt: the pose is not finite"));
}

TEST_CASE("Faulty frames and rows are skipped and counted", "[sensors]") {
  const RgbdFolder folder;
  std::size_t frames = 3, with_depth = 3;
  ReaderFault fault = ReaderFault::kMissingImage;
  std::string text;
  SECTION("no depth") {
    fs::remove(folder.path() / RgbdFolder::name(2, ".depth.png"));
    frames = 4;
    text = "frame-000002.depth.png: no such image";
  }
  SECTION("depth of 8 bits") {
    folder.write_image(RgbdFolder::name(2, ".depth.png"), cv::Mat(6, 8, CV_8UC1, cv::Scalar(9)));
    frames = 4;
    fault = ReaderFault::kWrongImageFormat;
    text = "frame-000002.depth.png: 8 bits";
  }
  SECTION("colour of another size") {
    folder.write_image(RgbdFolder::name(2, ".color.png"),
                       cv::Mat(5, 8, CV_8UC3, cv::Scalar::all(0)));
    fault = ReaderFault::kWrongImageSize;
    text = "frame-000002.color.png: 8x5 px, the calibration says 8x6";
  }
  SECTION("colour that is no image") {
    folder.write(RgbdFolder::name(0, ".color.png"), "hello");
    fault = ReaderFault::kUnreadableImage;
    text = "frame-000000.color.png: not an image";
  }
  RgbdFolderReader reader(folder.path());
  const auto all = read_all(reader);
  CHECK(all.size() == frames);
  CHECK(std::count_if(all.begin(), all.end(), [](const PosedFrame& f) {
          return f.frame->depth != nullptr;
        }) == static_cast<std::ptrdiff_t>(with_depth));
  REQUIRE(reader.report().entries().size() == 1);
  CHECK(reader.report().count(fault) == 1);
  CHECK_THAT(reader.report().entries().at(fault).first, Catch::Contains(text));
}

TEST_CASE("Rows that are no pose cost their frame", "[sensors]") {
  const RgbdFolder folder;
  const auto [row, text] = GENERATE(table<std::string, std::string>(
      {{"2 1 0 0 0 0 1 0 0 0 0 1", "line 2: not a frame number and the 12 numbers"},
       {"2 1 0 0 0 0 1 0 0 0 0 x 0", "line 2: x is not a number"},
       {"2 1 0 0 nan 0 1 0 0 0 0 1 0", "line 2: the pose is not finite"},
       {"2 2 0 0 0 0 1 0 0 0 0 1 0", "line 2: the pose is not rigid: |R R^T - I| = 3.0"},
       {"2 -1 0 0 0 0 1 0 0 0 0 1 0", "line 2: the pose is not rigid"}}));
  CAPTURE(row);
  folder.write("poses.txt", "0 1 0 0 0 0 1 0 0 0 0 1 0\n" + row + "\n");
  RgbdFolderReader reader(folder.path());
  CHECK(read_all(reader).size() == 1);
  CHECK(reader.report().count(ReaderFault::kMalformedRow) == 1);
  CHECK(reader.report().count(ReaderFault::kWithoutPose) == 3);
  CHECK_THAT(reader.report().entries().at(ReaderFault::kMalformedRow).first, Catch::Contains(text));
}

TEST_CASE("An RGB-D folder that cannot be used is refused by name", "[sensors]") {
  const RgbdFolder folder;
  CHECK_THROWS_WITH(RgbdFolderReader("/nowhere/at/all"), "/nowhere/at/all: no such folder");
  CHECK_THROWS_AS(RgbdFolderReader(folder.path(), {.rate_hz = 0.0}), std::invalid_argument);
  CHECK_THROWS_AS(RgbdFolderReader(folder.path(), {.baseline_m = -1.0}), std::invalid_argument);
  for (const std::string matrix :
       {"10 0 4 0 11 3", "-1 0 4 0 11 3 0 0 1", "10 0 4 0 11 nan 0 0 1"}) {
    folder.write("camera-intrinsics.txt", matrix);
    CHECK_THROWS_WITH(RgbdFolderReader(folder.path()), Catch::Contains("not a 3x3 matrix"));
  }
  folder.write("camera-intrinsics.txt", "10 0 4\n0 eleven 3\n0 0 1\n");
  CHECK_THROWS_WITH(RgbdFolderReader(folder.path()),
                    Catch::EndsWith("camera-intrinsics.txt line 2: eleven is not a number"));
  fs::remove(folder.path() / "camera-intrinsics.txt");
  CHECK_THROWS_WITH(RgbdFolderReader(folder.path()),
                    Catch::EndsWith("camera-intrinsics.txt: no such file"));
  for (const int number : {0, 2, 4, 6})
    fs::remove(folder.path() / RgbdFolder::name(number, ".color.png"));
  CHECK_THROWS_WITH(RgbdFolderReader(folder.path()), Catch::Contains("no image frame-NNNNNN"));
}

// Median distance [m] of the depths of frame a, carried into b, from those that b has there.
double depth_disagreement(const PosedFrame& a, const PosedFrame& b, const PinholeCamera& camera) {
  const SE3 T_b_a = b.T_world_cam.inverse() * a.T_world_cam;
  std::vector<double> errors;
  for (int y = 4; y < camera.height; y += 8)
    for (int x = 4; x < camera.width; x += 8) {
      const Eigen::Vector2d px(x, y);
      const auto rho_a = inverse_depth_at(*a.frame->depth, px, 0.05);
      if (!rho_a) continue;
      const Eigen::Vector3d p_b = T_b_a * (camera.unproject(px)->homogeneous() / *rho_a);
      if (p_b.z() < 0.1) continue;
      const auto rho_b = inverse_depth_at(*b.frame->depth, camera.project(p_b.hnormalized()), 0.05);
      if (rho_b) errors.push_back(std::abs(1.0 / *rho_b - p_b.z()));
    }
  REQUIRE(errors.size() > 500);
  const auto median = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), median, errors.end());
  return *median;
}

TEST_CASE("7-Scenes red kitchen: depth and poses agree on the room", "[sensors]") {
  const auto folder = shared_data("7scenes_redkitchen");
  if (!folder) return;
  RgbdFolderReader reader(*folder);
  CHECK(reader.frame_count() == 250);
  CHECK(reader.rig().cameras[0].width == 640);
  CHECK(reader.rig().cameras[0].fx == 585.0);
  std::vector<PosedFrame> frames;
  while (frames.size() < 12) frames.push_back(reader.next().value());
  CHECK(reader.report().empty());
  CHECK(frames[1].frame->stamp == 133'333'333);  // every fourth of 30 Hz
  for (const PosedFrame& frame : frames) {
    const auto& depths = frame.frame->depth->millimetres;
    const auto known = static_cast<double>(
        std::count_if(depths.begin(), depths.end(), [](std::uint16_t z) { return z > 0; }));
    CHECK(known > 0.5 * 640 * 480);
    CHECK(*std::max_element(depths.begin(), depths.end()) < 20'000);  // 65535 is none
  }
  // Kinect's noise at 2 to 3 m is a centimetre or two.
  CHECK(depth_disagreement(frames[0], frames[4], reader.rig().cameras[0]) < 0.03);
  CHECK(depth_disagreement(frames[0], frames[11], reader.rig().cameras[0]) < 0.04);
}

}  // namespace
}  // namespace km
