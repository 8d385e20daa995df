#include <catch2/catch.hpp>
#include <functional>

#include "modules/sensors/node/open_folder.hpp"
#include "test/modules/sensors/euroc_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// Checks that all frames are there, that the frame of index 2 lacks its depth (or labels), and that
// the report contains only this fault, with `text` in its example.
void check_image_lost(const EurocFolder& folder, const FolderOptions& options, ReaderFault fault,
                      const std::string& text) {
  const Outcome outcome = read(folder, options);
  REQUIRE(outcome.packets.size() == EurocFolder::kPairs);
  for (std::size_t i = 0; i < outcome.packets.size(); ++i) {
    CAPTURE(i);
    const StereoFrame& frame = *outcome.packets[i].frame;
    CHECK((options.labels ? frame.labels == nullptr : frame.depth == nullptr) == (i == 2));
  }
  REQUIRE(outcome.report.entries().size() == 1);
  CHECK(outcome.report.count(fault) == 1);
  CHECK_THAT(outcome.report.entries().begin()->second.first, Catch::Contains(text));
}

constexpr const char* kPalette =
    "name,red,green,blue,alpha,id\nunknown,0,0,0,255,0\nroad,128,64,128,255,3\n"
    "tree,0,200,10,255,7\n";

}  // namespace

TEST_CASE("Without a right camera, depth makes an RGB-D rig", "[sensors]") {
  const EurocFolder folder;
  folder.make_rgbd();
  const SensorRig rig = read_euroc_rig(folder.mav0());
  CHECK(rig.stereo.depth_source == DepthSource::kDepthImage);
  CHECK(rig.stereo.baseline_m() == Approx(0.08));
  REQUIRE(rig.depth);
  CHECK(rig.depth->min_m == 0.4);
  CHECK(rig.depth->max_m == 20.0);
  CHECK(rig.stereo.cameras[1].fx == 30.0);
  // To the right in the camera's frame, which is rotated against the body's.
  CHECK(rig.stereo.T_left_right().translation().isApprox(Eigen::Vector3d(0.08, 0, 0)));

  const Outcome outcome = read(folder);
  REQUIRE(outcome.packets.size() == EurocFolder::kPairs);
  CHECK(outcome.report.empty());
  for (const SensorPacket& packet : outcome.packets) {
    CHECK(packet.frame->left.width == 32);
    CHECK(packet.frame->right.width == 0);
    CHECK(packet.frame->right.pixels.empty());
    CHECK(packet.frame->labels == nullptr);
    REQUIRE(packet.frame->depth != nullptr);
    CHECK(packet.frame->depth->height == 24);
    CHECK(packet.frame->depth->millimetres == std::vector<std::uint16_t>(32 * 24, 2000));
  }
  CHECK(open_folder(folder.mav0()).pair_count() == EurocFolder::kPairs);
}

TEST_CASE("Range, scale and baseline of depth have defaults", "[sensors]") {
  const EurocFolder folder;
  folder.make_rgbd();
  for (const char* line :
       {"depth_scale: 0.001\n", "min_range_m: 0.4\n", "max_range_m: 20.0\n", "baseline_m: 0.08\n"})
    folder.replace("depth0/sensor.yaml", line, "");
  const SensorRig rig = read_euroc_rig(folder.mav0());
  CHECK(rig.stereo.baseline_m() == Approx(0.1));
  CHECK(rig.depth->min_m == 0.0);
  CHECK(rig.depth->max_m == 65.0);
  CHECK(read_depth_scale(folder.mav0()) == 0.001);
}

TEST_CASE("Depth and labels beside stereo are read on request", "[sensors]") {
  const EurocFolder folder;
  folder.add_depth();
  folder.add_labels(2);
  const bool depth = GENERATE(false, true), labels = GENERATE(false, true);
  CAPTURE(depth, labels);
  FolderReader reader = open_folder(folder.root(), {.depth = depth, .labels = labels});
  CHECK(reader.rig().depth.has_value() == depth);
  CHECK(reader.rig().stereo.depth_source == DepthSource::kRightImage);
  const auto first = reader.next(), second = reader.next();
  REQUIRE(first);
  CHECK(first->frame->right.width == 32);
  CHECK((first->frame->depth != nullptr) == depth);
  CHECK((first->frame->labels != nullptr) == labels);
  if (labels) CHECK(first->frame->labels->ids == std::vector<std::uint8_t>(32 * 24, 3));
  CHECK(second->frame->labels == nullptr);
}

TEST_CASE("A recording without requested depth or labels is refused", "[sensors]") {
  const EurocFolder folder;
  const auto refusal_with = [&](const FolderOptions& options, const std::string& end) {
    CHECK_THROWS_WITH(open_folder(folder.root(), options), Catch::Contains(end));
  };
  refusal_with({.depth = true},
               "depth0/sensor.yaml: no such file: a EuRoC folder has the "
               "calibration of depth0 there");
  refusal_with({.labels = true}, "label0/data.csv: no such file");
  folder.add_depth();
  fs::remove_all(folder.mav0() / "depth0/data");
  CHECK(read(folder, {.depth = true}).packets.size() == EurocFolder::kPairs);  // stereo only
  fs::remove_all(folder.mav0() / "cam1");
  refusal_with({}, "mav0: no depth image for any of 8 images, first: ");
  folder.write("depth0/data.csv", "55,55.png\n");
  refusal_with({}, "the stamps of depth images are too far away");
  fs::remove(folder.mav0() / "depth0/data.csv");
  refusal_with({}, "depth0/data.csv: no such file");
}

TEST_CASE("A depth or label image that cannot be used loses only itself", "[sensors]") {
  struct Case {
    const char* sensor;
    ReaderFault fault;
    const char* text;
    std::function<void(const fs::path&)> corrupt;
  };
  const auto pixels = [](const cv::Mat& image) {
    return [image](const fs::path& file) { write_png(file, image); };
  };
  using enum ReaderFault;
  const Case c = GENERATE_COPY(
      Case{"depth0", kMissingImage, ".png: no such image", [](auto& f) { fs::remove(f); }},
      Case{"depth0", kUnreadableImage, ".png: truncated image",
           [](auto& file) { fs::resize_file(file, fs::file_size(file) - 14); }},
      Case{"depth0", kWrongImageSize, "24x32 px, the calibration states 32x24",
           pixels(cv::Mat(32, 24, CV_16UC1, cv::Scalar(1000)))},
      Case{"depth0", kWrongImageFormat,
           "8 bits and 1 channels, depth is an image of 16 bits and one channel",
           pixels(cv::Mat(24, 32, CV_8UC1, cv::Scalar(10)))},
      Case{"depth0", kWrongImageFormat, "8 bits and 3 channels",
           pixels(cv::Mat(24, 32, CV_8UC3, cv::Scalar(10, 10, 10)))},
      Case{"label0", kWrongImageFormat, "no label_palette.csv",
           pixels(cv::Mat(24, 32, CV_8UC3, cv::Scalar(1, 2, 3)))},
      Case{"label0", kWrongImageFormat, "labels are 8-bit ids or 8-bit colours",
           pixels(cv::Mat(24, 32, CV_16UC1, cv::Scalar(3)))});
  CAPTURE(c.sensor, c.text);
  const bool labels = c.sensor == std::string("label0");
  const EurocFolder folder;
  labels ? folder.add_labels() : folder.make_rgbd();
  const std::string name = EurocFolder::side_image(c.sensor, 2);
  c.corrupt(folder.mav0() / name);
  check_image_lost(folder, {.labels = labels}, c.fault, c.text);
}

TEST_CASE("A depth image of no frame is counted", "[sensors]") {
  const EurocFolder folder;
  folder.make_rgbd();
  folder.replace("depth0/data.csv", "10100000000,", "10110000000,");
  check_image_lost(folder, {}, ReaderFault::kImageWithoutFrame,
                   "depth0/data.csv line 4: 10100000000.png");
}

TEST_CASE("Depths outside the sensor's range are dropped", "[sensors]") {
  const EurocFolder folder;
  folder.make_rgbd();
  cv::Mat pixels(24, 32, CV_16UC1, cv::Scalar(0));
  const std::uint16_t stored[] = {399, 400, 1000, 20000, 20001, 65535};
  for (int i = 0; i < 6; ++i) pixels.at<std::uint16_t>(0, i) = stored[i];
  folder.write_pixels(EurocFolder::side_image("depth0", 0), pixels);
  const auto depths = [&folder] {
    const auto all = read(folder).packets.front().frame->depth->millimetres;
    return std::vector<int>(all.begin(), all.begin() + 7);
  };
  CHECK(depths() == std::vector<int>{0, 400, 1000, 20000, 0, 0, 0});
  // Units of 0.2 mm, as in the TUM RGB-D data; 65535 still means not measured.
  folder.replace("depth0/sensor.yaml", "depth_scale: 0.001", "depth_scale: 0.0002");
  CHECK(depths() == std::vector<int>{0, 0, 0, 4000, 4000, 0, 0});
  folder.replace("depth0/sensor.yaml", "depth_scale: 0.0002", "depth_scale: 0.01");
  folder.replace("depth0/sensor.yaml", "max_range_m: 20.0", "max_range_m: 1000");
  CHECK(depths() == std::vector<int>{3990, 4000, 10000, 0, 0, 0, 0});
}

TEST_CASE("Depth that is not aligned with the left camera is refused", "[sensors]") {
  struct Case {
    const char *from, *to, *message;
  };
  const Case c = GENERATE(
      Case{"[32, 24]", "[64, 48]", "line 9: resolution: not that of cam0, 32 x 24"},
      Case{"[30.0,", "[30.1,", "line 11: intrinsics: not those of cam0"},
      Case{"[-0.2,", "[-0.1,", "line 13: distortion_coefficients: not those of cam0"},
      Case{"0, -1, 0, 0.0", "0, -1, 0, 0.1", "line 3: T_BS: not that of cam0"},
      Case{"min_range_m: 0.4", "min_range_m: 40", "line 15: min_range_m is not a number from 0"},
      Case{"min_range_m: 0.4", "min_range_m: .nan", "line 15: min_range_m is not a number from 0"},
      Case{"max_range_m: 20.0", "max_range_m: .inf", "line 16: max_range_m is not a number within"},
      Case{"baseline_m: 0.08", "baseline_m: -0.08", "line 17: baseline_m is not a number within"},
      Case{"depth_scale: 0.001", "depth_scale: 0", "line 14: depth_scale is not a number within"});
  CAPTURE(c.from, c.to);
  const EurocFolder folder;
  folder.make_rgbd();
  folder.replace("depth0/sensor.yaml", c.from, c.to);
  CHECK_THROWS_WITH(open_folder(folder.root()),
                    Catch::Contains("depth0/sensor.yaml") && Catch::Contains(c.message));
}

TEST_CASE("The palette maps labels from colours to ids", "[sensors]") {
  const EurocFolder folder;
  folder.add_labels();
  folder.write("label_palette.csv", kPalette);
  const int channels = GENERATE(3, 4);
  CAPTURE(channels);
  cv::Mat bgr(24, 32, CV_8UC3, cv::Scalar(128, 64, 128));
  bgr.at<cv::Vec3b>(0, 1) = {10, 200, 0};
  bgr.at<cv::Vec3b>(0, 2) = {11, 200, 0};  // a colour of no class
  if (channels == 4) {
    const cv::Mat alpha(24, 32, CV_8UC1, cv::Scalar(7));
    const std::vector<cv::Mat> planes = {bgr, alpha};
    cv::Mat bgra;
    cv::merge(planes, bgra);
    bgr = bgra;
  }
  folder.write_pixels(EurocFolder::side_image("label0", 2), bgr);
  const Outcome outcome = read(folder, {.labels = true});
  REQUIRE(outcome.packets.size() == EurocFolder::kPairs);
  const auto& ids = outcome.packets[2].frame->labels->ids;
  REQUIRE(ids.size() == 32 * 24);
  CHECK(ids[0] == 3);
  CHECK(ids[1] == 7);
  CHECK(ids[2] == 0);
  CHECK(ids[3] == 3);
  CHECK(outcome.report.count(ReaderFault::kUnknownColor) == 1);
  CHECK(open_folder(folder.root(), {.labels = true}).folder().palette.find(7)->name == "tree");
  folder.write("label_palette.csv", "name,red,green,blue,alpha,id\nroad,128,64,300,255,3\n");
  CHECK_THROWS_WITH(open_folder(folder.root(), {.labels = true}),
                    Catch::Contains("label_palette.csv"));
  CHECK_THAT(outcome.report.entries().begin()->second.first, Catch::EndsWith(".png: 1 pixels"));
}

}  // namespace km
