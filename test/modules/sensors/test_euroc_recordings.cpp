#include "modules/core/data/imu_limits.hpp"
#include "modules/sensors/image_file.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/image_file.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr std::int64_t kDay_ns = 86'400'000'000'000;

// Bytes of a PNG file whose header says `width` x `height`, with too few bytes after it.
std::string png_of(std::uint32_t width, std::uint32_t height) {
  const std::vector<std::uint8_t> encoded = encode_png(cv::Mat(24, 32, CV_8UC1, cv::Scalar(7)));
  std::string bytes(encoded.begin(), encoded.end());
  for (std::size_t i = 0; i < 4; ++i) {
    bytes[16 + i] = static_cast<char>(width >> (24 - 8 * i));
    bytes[20 + i] = static_cast<char>(height >> (24 - 8 * i));
  }
  return bytes;
}

// Invariants of a reader for any files.
void check_recording(FolderReader& reader) {
  check_rig(reader.rig());
  Stamp last = 0;
  for (const SensorPacket& packet : packets_of(reader)) {
    CHECK(packet.frame->stamp > last);
    last = packet.frame->stamp;
    CHECK(packet.frame->left.pixels.size() == 32 * 24);
    for (std::size_t i = 0; i < packet.imu.size(); ++i) {
      CHECK(is_plausible(packet.imu[i]));
      if (i > 0) CHECK(packet.imu[i - 1].stamp < packet.imu[i].stamp);
    }
  }
  const ReaderReport report = reader.report();
  for (const auto& [fault, entry] : report.entries()) {
    CAPTURE(to_string(fault), entry.first);
    CHECK(entry.first.find("/mav0/") != entry.first.npos);
    CHECK(entry.first.size() < 1000);
  }
}

struct Row {
  const char* what;
  const char* file;
  int line;            // line of the list
  std::string values;  // for the row; "+N" and "-N" move its stamp
  ReaderFault fault;
  std::size_t packets;
};

// Corrupts one row of a list.
void corrupt_row(const EurocFolder& folder, const Row& row) {
  const std::string text = folder.read(row.file);
  std::size_t begin = 0;
  for (int line = 1; line < row.line; ++line) begin = text.find('\n', begin) + 1;
  const std::size_t end = text.find('\n', begin);
  std::string line = text.substr(begin, end - begin);
  const std::size_t comma = line.find(',');
  if (row.values.starts_with('+') || row.values.starts_with('-'))
    line = std::to_string(std::stoll(line.substr(0, comma)) + std::stoll(row.values)) +
           line.substr(comma);
  else
    line.replace(comma + 1, line.npos, row.values);
  folder.write(row.file, text.substr(0, begin) + line + text.substr(end));
}

}  // namespace

TEST_CASE("A bad row is skipped and counted with its line and no other row is") {
  const std::string day = std::to_string(kDay_ns);
  const Row row = GENERATE_COPY(
      Row{"gyro 1e300", "imu0/data.csv", 300, "1e300,0,0,0,0,9.8", ReaderFault::kImplausible, 8},
      Row{"gyro 150", "imu0/data.csv", 300, "0,0,150,0,0,9.8", ReaderFault::kImplausible, 8},
      Row{"accel -1e300", "imu0/data.csv", 300, "0,0,0,-1e300,0,9.8", ReaderFault::kImplausible, 8},
      Row{"NaN", "imu0/data.csv", 300, "nan,0,0,0,0,9.8", ReaderFault::kNotFinite, 8},
      Row{"text", "imu0/data.csv", 300, "zero,0,0,0,0,9.8", ReaderFault::kMalformedSample, 8},
      Row{"too few fields", "imu0/data.csv", 300, "0,0,0,0", ReaderFault::kMalformedSample, 8},
      Row{"infinite", "imu0/data.csv", 300, "0,0,0,inf,0,9.8", ReaderFault::kNotFinite, 8},
      Row{"beyond a double", "imu0/data.csv", 300, "0,0,0,1e400,0,9", ReaderFault::kMalformedSample,
          8},
      Row{"imu a day ahead", "imu0/data.csv", 300, '+' + day, ReaderFault::kUnorderedSample, 8},
      Row{"imu at once", "imu0/data.csv", 2, '+' + day, ReaderFault::kUnorderedSample, 8},
      Row{"imu at last", "imu0/data.csv", 502, '+' + day, ReaderFault::kJumpingSample, 8},
      Row{"imu a second behind", "imu0/data.csv", 300, "-1000000001", ReaderFault::kUnorderedSample,
          8},
      Row{"image at last", "cam0/data.csv", 9, '+' + day, ReaderFault::kJumpingStamp, 7},
      Row{"image a day ahead", "cam0/data.csv", 4, '+' + day, ReaderFault::kUnorderedStamp, 7},
      Row{"image at once", "cam0/data.csv", 2, '+' + day, ReaderFault::kUnorderedStamp, 7},
      Row{"image behind", "cam0/data.csv", 5, "-149999999", ReaderFault::kUnorderedStamp, 7},
      Row{"folder for an image", "cam0/data.csv", 4, ".", ReaderFault::kMissingImage, 7},
      Row{"a name too long", "cam0/data.csv", 4, std::string(5000, 'n'), ReaderFault::kMissingImage,
          7});
  CAPTURE(row.what);
  const EurocFolder folder;
  corrupt_row(folder, row);
  FolderReader reader = open_folder(folder.root());
  CHECK(packets_of(reader).size() == row.packets);
  REQUIRE(reader.report().count(row.fault) == 1);
  const ReaderReport report = reader.report();
  CHECK_THAT(report.entries().at(row.fault).first,
             Contains(std::string(row.file) + " line " + std::to_string(row.line)));
  CHECK(reader.report().count(ReaderFault::kImuGap) == 0);
}

struct BadImage {
  const char* what;
  ReaderFault fault;
  const char* problem;
  std::function<void(const fs::path&)> corrupt;
};

// Replaces a file.
auto by_bytes(std::string bytes) {
  return [bytes = std::move(bytes)](const fs::path& file) {
    fs::remove(file);
    std::ofstream(file, std::ios::binary) << bytes;
  };
}

TEST_CASE("A bad image loses its pair and no inertial sample") {
  using enum ReaderFault;
  const BadImage bad = GENERATE(
      BadImage{"missing", kMissingImage, ".png: no such image", [](auto& f) { fs::remove(f); }},
      BadImage{"a symbolic link to itself", kMissingImage,
               "no such image: Too many levels of symbolic links",
               [](const fs::path& file) {
                 fs::remove(file);
                 fs::create_symlink(file.filename(), file);
               }},
      BadImage{"truncated", kUnreadableImage, "truncated image",
               [](auto& file) { fs::resize_file(file, fs::file_size(file) - 14); }},
      BadImage{"larger than memory", kUnreadableImage, "larger than 256 MiB",
               [](auto& file) { fs::resize_file(file, std::uintmax_t{1} << 40U); }},
      BadImage{"empty", kUnreadableImage, "empty", by_bytes("")},
      BadImage{"text", kUnreadableImage, "neither a PNG nor a JPEG file", by_bytes("hello")},
      BadImage{"another size", kWrongImageSize, "24x32 px, the calibration states 32x24",
               [](auto& file) { write_png(file, cv::Mat(32, 24, CV_8UC1)); }},
      BadImage{"65535 x 65535", kWrongImageSize, "65535x65535 px, the calibration states 32x24",
               by_bytes(png_of(65535, 65535))},
      BadImage{"4294967295 x 1", kWrongImageSize, "px, the calibration states",
               by_bytes(png_of(0xffffffffU, 1))},
      BadImage{"0 x 0", kWrongImageSize, "0x0 px, the calibration states", by_bytes(png_of(0, 0))});
  CAPTURE(bad.what);
  const EurocFolder folder;
  bad.corrupt(folder.image("cam1", 3));
  const Outcome outcome = read(folder);
  REQUIRE(outcome.packets.size() == EurocFolder::kPairs - 1);
  CHECK(outcome.report.entries().size() == 1);
  REQUIRE(outcome.report.count(bad.fault) == 1);
  CHECK_THAT(outcome.report.entries().at(bad.fault).first,
             Contains("cam0/data.csv line 5: ") && Contains(bad.problem));
  CHECK(outcome.packets[3].imu.size() == 21);  // 100 ms
  CHECK(outcome.packets[3].imu.front().stamp == outcome.packets[2].imu.back().stamp);
}

TEST_CASE("A corrupted list or calibration is refused or gives valid packets") {
  const std::string file =
      GENERATE("imu0/data.csv", "cam0/data.csv", "cam1/data.csv", "imu0/sensor.yaml",
               "cam0/sensor.yaml", "cam1/sensor.yaml", "depth0/sensor.yaml");
  CAPTURE(file);
  const EurocFolder folder;
  if (file.starts_with("depth0")) folder.make_rgbd();
  const std::string good = folder.read(file);
  check_corrupted<DatasetError>(good, folder.root().string(), [&](const std::string& text) {
    folder.write(file, text);
    FolderReader reader = open_folder(folder.root());
    check_recording(reader);
  });
}

TEST_CASE("A corrupted image gives an image of the right size or none") {
  const bool is_jpeg = GENERATE(false, true);
  CAPTURE(is_jpeg);
  cv::Mat pixels(24, 32, CV_8UC1);
  cv::randu(pixels, 0, 255);
  const std::vector<std::uint8_t> encoded = is_jpeg ? encode_jpeg(pixels, 95) : encode_png(pixels);
  const TemporaryFolder folder;
  check_corrupted<DatasetError>(
      {encoded.begin(), encoded.end()}, "", [&](const std::string& bytes) {
        const ImageResult loaded = load_gray_image(folder.write("image", bytes), 32, 24);
        const bool ok = !loaded.fault;
        CHECK(loaded.image.pixels.size() == (ok ? 32 * 24 : 0));
        CHECK(loaded.problem.empty() == ok);
      });
}

namespace {

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
  CHECK_THAT(outcome.report.entries().begin()->second.first, Contains(text));
}

constexpr const char* kPalette =
    "name,red,green,blue,alpha,id\nunknown,0,0,0,255,0\nroad,128,64,128,255,3\n"
    "tree,0,200,10,255,7\n";

}  // namespace

TEST_CASE("Without a right camera, depth makes an RGB-D rig") {
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

TEST_CASE("Range, scale and baseline of depth have defaults") {
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

TEST_CASE("Depth and labels beside stereo are read on request") {
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

TEST_CASE("A recording without requested depth or labels is refused") {
  const EurocFolder folder;
  const auto refusal_with = [&](const FolderOptions& options, const std::string& end) {
    CHECK_THROWS_WITH(open_folder(folder.root(), options), Contains(end));
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

TEST_CASE("A depth or label image that cannot be used loses only itself") {
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

TEST_CASE("A depth image of no frame is counted") {
  const EurocFolder folder;
  folder.make_rgbd();
  folder.replace("depth0/data.csv", "10100000000,", "10110000000,");
  check_image_lost(folder, {}, ReaderFault::kImageWithoutFrame,
                   "depth0/data.csv line 4: 10100000000.png");
}

TEST_CASE("Depths outside the sensor's range are dropped") {
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

TEST_CASE("Depth that is not aligned with the left camera is refused") {
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
                    Contains("depth0/sensor.yaml") && Contains(c.message));
}

TEST_CASE("The palette maps labels from colours to ids") {
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
  CHECK_THROWS_WITH(open_folder(folder.root(), {.labels = true}), Contains("label_palette.csv"));
  CHECK_THAT(outcome.report.entries().begin()->second.first, EndsWith(".png: 1 pixels"));
}

}  // namespace km
