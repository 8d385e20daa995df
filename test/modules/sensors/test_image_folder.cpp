#include "modules/sensors/folder_layouts.hpp"

#include "euroc_folder.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "test/support/image_file.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr int kFrames = 4;

void write_image(const fs::path& file, int type, double value) {
  fs::create_directories(file.parent_path());
  write_png(file, cv::Mat(24, 32, type, cv::Scalar::all(value)));
}

const std::string kP0 = "P0: 30 0 16 0 0 30 12 0 0 0 1 0\n";
const std::string kP1 = "P1: 30 0 16 -15 0 30 12 0 0 0 1 0\n";

// A recording at 10 Hz, with a baseline of half a metre.
void write_kitti(const TemporaryFolder& folder) {
  folder.write("calib.txt", kP0 + kP1 + "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n");
  folder.write("times.txt", "0.0\n1.0e-01\n2.0e-01\n3.0e-01\n");
  for (int k = 0; k < kFrames; ++k)
    for (const char* camera : {"image_0", "image_1"})
      write_image(folder.path() / camera / ("00000" + std::to_string(k) + ".png"), CV_8UC1, 10 * k);
}

// Depth images come 5 ms after the others; the third one is missing from the list.
void write_tum(const fs::path& root) {
  fs::create_directories(root);
  std::ofstream rgb(root / "rgb.txt"), depth(root / "depth.txt");
  rgb << "# color images\n# timestamp filename\n";
  for (int k = 0; k < kFrames; ++k) {
    const std::string name = std::to_string(k) + ".png";
    rgb << "1305031102." << k << "00 rgb/" << name << '\n';
    if (k != 2) depth << "1305031102." << k << "05 depth/" << name << '\n';
    write_image(root / "rgb" / name, CV_8UC3, 10 * k);
    write_image(root / "depth" / name, CV_16UC1, 10000);
  }
}

TEST_CASE("A folder in KITTI's layout is read with its calibration") {
  const TemporaryFolder folder;
  write_kitti(folder);
  CHECK(layout_of(folder.path()) == FolderLayout::kKitti);
  FolderReader reader = open_folder(folder.path());
  const StereoRig& rig = reader.rig().stereo;
  CHECK_FALSE(reader.rig().has_imu);
  CHECK(rig.baseline_m() == Approx(0.5));
  CHECK(rig.cameras[0].width == 32);
  CHECK(rig.cameras[1].fx == 30.0);
  CHECK(rig.cameras[0].T_body_cam.isApprox(SE3::Identity()));  // the body is the left camera
  CHECK(rig.cameras[1].T_body_cam.translation().x() == Approx(0.5));
  const auto packets = packets_of(reader);
  REQUIRE(packets.size() == kFrames);
  CHECK(packets[3].frame->stamp == 300'000'000);
  CHECK(packets[3].frame->left.pixels[0] == 30);
  CHECK(packets[3].frame->right.pixels[0] == 30);
  CHECK(packets[3].frame->decode_color().pixels.empty());  // grey images
  CHECK(packets[3].imu.empty());
  CHECK(reader.report().empty());
  CHECK(open_folder(folder.path(), {.part = {.from_s = 0.05, .to_s = 0.25}}).pair_count() == 2);
  CHECK_THROWS_AS(open_folder(folder.path(), {.part = {.from_s = 7.0}}), DatasetError);
  CHECK_THROWS_WITH(open_folder(folder.path(), {}, "camera.yaml"), Contains("leave --rig out"));
}

TEST_CASE("A bad file of a folder in KITTI's layout is refused with file, line and value") {
  struct Case {
    std::string file, text, message;
  };
  const Case c = GENERATE(
      Case{"calib.txt", kP0, "calib.txt: no row P1:"},
      Case{"calib.txt", kP0 + "P1: 30 0 16 nan 0 30 12 0 0 0 1 0\n",
           "calib.txt line 2: nan is not a number"},
      Case{"calib.txt", kP0 + "P1: 30 0 16 -15 0 30\n", "calib.txt line 2: 6 numbers, expected 12"},
      Case{"calib.txt", "P0: 0 0 16 0 0 0 12 0 0 0 1 0\n" + kP1, "calib.txt line 1: "},
      Case{"calib.txt", kP0 + "P1: 30 0 16 15 0 30 12 0 0 0 1 0\n", "calib.txt line 2: P1 "},
      Case{"calib.txt", "", "calib.txt: no such file"},
      Case{"times.txt", "\n", "times.txt: no time in it"},
      Case{"times.txt", "nan\n", "times.txt: no time in it; 1 malformed rows, first: "});
  CAPTURE(c.file, c.text);
  const TemporaryFolder folder;
  write_kitti(folder);
  folder.write(c.file, c.text);
  if (c.text.empty()) fs::remove(folder.path() / c.file);
  CHECK_THROWS_WITH(open_folder(folder.path()), Contains(c.message));
  fs::remove_all(folder.path() / "image_1");
  CHECK_THROWS_WITH(open_folder(folder.path()), Contains("image_1: no such folder"));
}

TEST_CASE("Faulty times and images of a folder in KITTI's layout are left out and counted") {
  struct Case {
    const char *times, *missing;
    ReaderFault fault;
    const char* example;
    std::size_t frames = 3;
  };
  constexpr const char* kTimes = "0.0\n0.1\n0.2\n0.3\n";
  using enum ReaderFault;
  const Case c = GENERATE_COPY(
      Case{"nan\n0.1\n0.2\n0.3\n", "", kMalformedRow, "line 1: nan is no time in seconds"},
      Case{"0.0\n\nnan\n0.2\n0.3\n", "", kMalformedRow, "line 3: nan is no time in seconds"},
      Case{"# seconds\n0.0\n \t\n0.15\n0.12\n0.3\n", "", kUnorderedStamp, "times.txt line"},
      Case{kTimes, "image_1/000001.png", kMissingImage, "000001.png"},
      Case{kTimes, "image_0/000000.png", kMissingImage, "000000.png"},
      Case{"0.0\n0.1\n0.2\n", "", kImageWithoutTime, "image_0/000003.png: no time in", 3});
  CAPTURE(c.times, c.missing);
  const TemporaryFolder folder;
  write_kitti(folder);
  folder.write("times.txt", c.times);
  if (*c.missing != 0) fs::remove(folder.path() / c.missing);
  FolderReader reader = open_folder(folder.path());
  const auto packets = packets_of(reader);
  CHECK(packets.size() == c.frames);
  for (const SensorPacket& packet : packets)  // rows stay with their images
    if (c.fault != kUnorderedStamp)
      CHECK(packet.frame->left.pixels[0] == std::lround(1e-7 * double(packet.frame->stamp)));
  const ReaderReport report = reader.report();
  REQUIRE(report.count(c.fault) == 1);
  CHECK_THAT(report.entries().at(c.fault).first, Contains(c.example));
}

TEST_CASE("A folder in the layout of TUM RGB-D has the camera of its name") {
  const TemporaryFolder folder;
  const fs::path root = folder.path() / "rgbd_dataset_freiburg2_desk";
  write_tum(root);
  CHECK(layout_of(root) == FolderLayout::kTum);
  CHECK(tum_camera(root / "").value().camera.fx == 520.9);
  // The images of this test are smaller than those of the benchmark.
  FolderReader reader = open_folder(root);
  CHECK(packets_of(reader).empty());
  CHECK_FALSE(tum_camera(folder.path() / "desk"));
}

TEST_CASE("The camera of a folder in the layout of TUM RGB-D can be described") {
  const TemporaryFolder folder;
  const fs::path root = folder.path() / "desk";
  write_tum(root);
  CHECK_THROWS_WITH(open_folder(root), Contains("--rig FILE"));
  const fs::path camera =
      folder.write("camera.yaml",
                   "resolution: [32, 24]\ncamera_model: pinhole\nintrinsics: [30, 30, 16, 12]\n"
                   "distortion_model: none\nmax_range_m: 5\nbaseline_m: 0.075\n");
  FolderReader reader = open_folder(root, {}, camera);
  CHECK_FALSE(reader.rig().has_imu);
  CHECK(reader.rig().stereo.depth_source == DepthSource::kDepthImage);
  CHECK(reader.rig().stereo.baseline_m() == Approx(0.075));
  CHECK(reader.rig().depth->max_m == 5.0);
  const auto packets = packets_of(reader);
  REQUIRE(packets.size() == kFrames);
  for (std::size_t k = 0; k < packets.size(); ++k) {
    CHECK(std::abs(packets[k].frame->stamp -
                   (1305031102'000'000'000 + static_cast<Stamp>(k) * 100'000'000)) < 1000);
    REQUIRE((packets[k].frame->depth != nullptr) == (k != 2));
    if (k != 2) CHECK(packets[k].frame->depth->millimetres[0] == 2000);  // 10000 / 5000 m
  }
  std::ofstream(root / "rgb.txt") << "1305031102.0 rgb/0.png\n1305031102.1\nnan rgb/2.png\n";
  FolderReader faulty = open_folder(root, {}, camera);
  CHECK(packets_of(faulty).size() == 1);
  CHECK_THAT(faulty.report().entries().at(ReaderFault::kMalformedRow).first,
             Contains("rgb.txt line 2: 1 fields, expected 2"));
  CHECK(faulty.report().count(ReaderFault::kMalformedRow) == 2);
  std::ofstream(root / "depth.txt") << "1305031109.0 depth/0.png\n";
  CHECK_THROWS_WITH(open_folder(root, {}, camera),
                    EndsWith("rgb.txt: no depth image for any of 1 images: the stamps of "
                             "depth images are too far away"));
  fs::remove(root / "depth.txt");
  CHECK_THROWS_WITH(open_folder(root, {}, camera), Contains("depth.txt: no such file"));
}

// Frames 0, 4 and 12 of a recording; the grey value of an image is its number.
void write_seven_scenes(const TemporaryFolder& folder) {
  folder.write("camera-intrinsics.txt", "30 0 16\n0 30 12\n0 0 1\n");
  for (const int k : {0, 4, 12}) {
    const std::string stem = "frame-0000" + std::string(k < 10 ? "0" : "") + std::to_string(k);
    write_image(folder.path() / (stem + ".color.png"), CV_8UC3, k);
    write_image(folder.path() / (stem + ".depth.png"), CV_16UC1, 1500);
  }
}

TEST_CASE("A folder in the layout of 7-Scenes is read at 30 Hz") {
  const TemporaryFolder folder;
  write_seven_scenes(folder);
  FolderReader reader = open_folder(folder.path());
  const auto packets = packets_of(reader);
  REQUIRE(packets.size() == 3);
  CHECK(packets[2].frame->stamp == 400'000'000);
  CHECK(packets[2].frame->left.pixels[0] == 12);
  CHECK(packets[2].frame->decode_color().pixels.at(31) == ColorImage::Pixel{12, 12, 12});
  CHECK(packets[2].frame->depth->millimetres[0] == 1500);
  for (const char* frame : {"0000", "0004", "0012"})
    fs::remove(folder.path() / ("frame-00" + std::string(frame) + ".depth.png"));
  CHECK_THROWS_WITH(open_folder(folder.path()),
                    Contains(": no depth image for any of 3 images, first: "));
  folder.write("camera-intrinsics.txt", "30 0 16\n0 30 inf\n0 0 1\n");
  CHECK_THROWS_WITH(open_folder(folder.path()),
                    Contains("camera-intrinsics.txt line 2: inf is not a number"));
}

TEST_CASE("The names of frames show the layout of 7-Scenes without a calibration") {
  const TemporaryFolder folder;
  write_seven_scenes(folder);
  fs::remove(folder.path() / "camera-intrinsics.txt");
  const std::string missing = GENERATE("", ".color.", ".depth.");
  CAPTURE(missing);
  for (const char* frame : {"frame-000000", "frame-000004", "frame-000012"})
    if (!missing.empty()) fs::remove(folder.path() / (frame + missing + "png"));
  CHECK(layout_of(folder.path()) == FolderLayout::kSevenScenes);
  CHECK_THROWS_WITH(open_folder(folder.path()), EndsWith("camera-intrinsics.txt: no such file"));
}

}  // namespace
}  // namespace km
