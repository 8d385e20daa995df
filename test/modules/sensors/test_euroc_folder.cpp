#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// The contract of SensorPacket: samples in order, each packet starts with the last sample of the
// one before, and ends with the first sample at or after its frame.
void check_imu_contract(const std::vector<SensorPacket>& packets) {
  for (std::size_t i = 0; i < packets.size(); ++i) {
    CAPTURE(i);
    const auto& imu = packets[i].imu;
    const Stamp stamp = packets[i].frame->stamp;
    REQUIRE_FALSE(imu.empty());
    for (std::size_t k = 1; k < imu.size(); ++k) REQUIRE(imu[k - 1].stamp < imu[k].stamp);
    CHECK(imu.back().stamp >= stamp);
    if (imu.size() > 1) CHECK(imu[imu.size() - 2].stamp < stamp);
    if (i > 0) CHECK(imu.front().stamp == packets[i - 1].imu.back().stamp);
  }
}

std::string first_of(const ReaderReport& report, ReaderFault fault) {
  REQUIRE(report.count(fault) > 0);
  return report.entries().at(fault).first;
}

}  // namespace

TEST_CASE("A recording without faults gives every pair and every sample between them") {
  const EurocFolder folder(GENERATE(".png", ".jpg"));
  FolderReader reader = open_folder(folder.root());
  const auto packets = packets_of(reader);
  REQUIRE(packets.size() == EurocFolder::kPairs);
  CHECK(reader.pair_count() == EurocFolder::kPairs);
  CHECK(reader.report().empty());
  check_imu_contract(packets);
  for (int i = 0; i < EurocFolder::kPairs; ++i) {
    const StereoFrame& frame = *packets[static_cast<std::size_t>(i)].frame;
    CHECK(frame.stamp == EurocFolder::image_stamp(i));
    CHECK(frame.left.width == 32);
    CHECK(frame.right.height == 24);
    REQUIRE(frame.left.pixels.size() == 32 * 24);
    CHECK(frame.left.pixels.front() == 10 * (i + 1));
    CHECK(frame.right.pixels.back() == 10 * (i + 1));
  }
  // 50 ms at 200 Hz: ten intervals, eleven samples.
  CHECK(packets[1].imu.size() == 11);
  CHECK(packets[1].imu[0].gyro == Eigen::Vector3d(0.1, 0.2, 0.3));
  CHECK(packets[1].imu[0].accel == Eigen::Vector3d(1.0, 2.0, 9.8));
}

TEST_CASE("A window is half open and counts from the recording's first image") {
  const EurocFolder folder;
  FolderReader first = open_folder(folder.root(), {.part = {.from_s = 0.0, .to_s = 0.2}});
  FolderReader second = open_folder(folder.root(), {.part = {.from_s = 0.2, .to_s = 100.0}});
  const auto a = packets_of(first);
  const auto b = packets_of(second);
  REQUIRE(a.size() == 4);
  REQUIRE(b.size() == 4);
  CHECK(a.back().frame->stamp == EurocFolder::image_stamp(3));
  CHECK(b.front().frame->stamp == EurocFolder::image_stamp(4));
  // Samples begin a second before the first frame, and so before the window.
  CHECK(b.front().imu.front().stamp == b.front().frame->stamp - 1'000'000'000);
  CHECK(b.front().imu.size() == 201);
  CHECK(second.folder().frames.front().stamp == EurocFolder::image_stamp(4));
  CHECK(second.folder().frames.back().stamp == EurocFolder::image_stamp(7));
  CHECK_THROWS_AS(open_folder(folder.root(), {.part = {.from_s = 1.0, .to_s = 1.0}}),
                  std::invalid_argument);
  CHECK_THROWS_AS(open_folder(folder.root(), {.part = {.from_s = std::nan("")}}),
                  std::invalid_argument);
  CHECK_THROWS_WITH(open_folder(folder.root(), {.part = {.from_s = 1.0}}),
                    Contains("from 0 s to 0.35 s"));
}

TEST_CASE("Blanks, comments, CRLF and a bare header in the lists are accepted") {
  const EurocFolder folder;
  std::string list = "timestamp [ns] , filename\r\n";
  for (int i = 0; i < EurocFolder::kPairs; ++i) {
    const std::string stamp = std::to_string(EurocFolder::image_stamp(i));
    list += "  " + stamp + " ,  " + stamp + ".png  # note\r\n\r\n";
  }
  folder.write("cam0/data.csv", list);
  FolderReader reader = open_folder(folder.root());
  CHECK(packets_of(reader).size() == EurocFolder::kPairs);
  CHECK(reader.report().empty());
}

TEST_CASE("Stamps of left and right may differ by the tolerance") {
  const EurocFolder folder;
  folder.replace("cam1/data.csv", "10100000000,", "10100900000,");
  CHECK(open_folder(folder.root()).pair_count() == 8);
  folder.replace("cam1/data.csv", "10100900000,", "10120000000,");
  FolderReader strict = open_folder(folder.root());
  CHECK(strict.pair_count() == 7);
  CHECK(strict.report().count(ReaderFault::kLeftWithoutRight) == 1);
  CHECK(strict.report().count(ReaderFault::kRightWithoutLeft) == 1);
}

TEST_CASE("Missing files and folders are refused by name") {
  const EurocFolder folder;
  CHECK_THROWS_WITH(open_folder("/nowhere/at/all"), "/nowhere/at/all: no such folder");
  for (const std::string file : {"cam0/data.csv", "cam1/data.csv", "imu0/data.csv",
                                 "cam0/sensor.yaml", "cam1/sensor.yaml", "imu0/sensor.yaml"}) {
    CAPTURE(file);
    const EurocFolder corrupted;
    fs::remove(corrupted.mav0() / file);
    CHECK_THROWS_WITH(open_folder(corrupted.root()),
                      StartsWith((corrupted.mav0() / file).string() + ": no such file"));
  }
  fs::remove_all(folder.mav0() / "cam1");
  for (const fs::path& path : {folder.root(), folder.mav0()})
    CHECK_THROWS_WITH(open_folder(path),
                      Contains("cam1/sensor.yaml: no such file") && Contains("nor depth0"));
  fs::remove_all(folder.mav0());
  CHECK_THROWS_WITH(open_folder(folder.root()),
                    EndsWith("neither a folder mav0 nor cam0 in it: not a recording in the "
                             "layout of EuRoC, KITTI, TUM RGB-D or 7-Scenes"));
  for (const char* robot : {"robot1", "robot0", "robot2/none"})
    fs::create_directories(folder.root() / robot / (robot[5] < '2' ? "mav0" : "cam0"));
  CHECK_THROWS_WITH(open_folder(folder.root()), EndsWith("in it are robot0, robot1"));
}

TEST_CASE("A recording needs no inertial sensor") {
  const EurocFolder folder;
  const FolderOptions options{.imu = false};
  const SE3 T_imu_left = open_folder(folder.root()).rig().stereo.cameras[0].T_body_cam;
  SECTION("an existing inertial sensor defines the body") {}
  SECTION("without an inertial sensor the body is the reference of all poses of sensors") {
    fs::remove_all(folder.mav0() / "imu0");
    CHECK_FALSE(open_folder(folder.root()).rig().has_imu);
    CHECK(open_folder(folder.mav0()).pair_count() == EurocFolder::kPairs);
  }
  FolderReader reader = open_folder(folder.root(), options);
  CHECK_FALSE(reader.rig().has_imu);
  CHECK(
      reader.rig().stereo.cameras[0].T_body_cam.isApprox(T_imu_left));  // its T_BS is the identity
  const auto packets = packets_of(reader);
  REQUIRE(packets.size() == EurocFolder::kPairs);
  for (const SensorPacket& packet : packets) CHECK(packet.imu.empty());
  CHECK(reader.report().empty());
}

TEST_CASE("A correction moves the stamps of images and the cameras") {
  const EurocFolder folder;
  folder.add_depth();
  FolderReader right = open_folder(folder.root());
  const CameraCalibration correction{0.0125,
                                     make_pose(Eigen::Matrix3d::Identity(), {0.1, 0.2, 0.3})};
  FolderReader corrected = open_folder(folder.root(), {.correction = correction, .depth = true});
  const auto packets = packets_of(corrected), unmoved = packets_of(right);
  REQUIRE(packets.size() == EurocFolder::kPairs);
  for (std::size_t k = 0; k < packets.size(); ++k) {
    CHECK(packets[k].frame->stamp == EurocFolder::image_stamp(static_cast<int>(k)) + 12'500'000);
    CHECK(packets[k].imu.back().stamp >= packets[k].frame->stamp);
    CHECK(packets[k].frame->left.pixels == unmoved[k].frame->left.pixels);
    CHECK(packets[k].frame->depth != nullptr);
  }
  for (const std::size_t c : {0U, 1U})
    CHECK(corrected.rig().stereo.cameras[c].T_body_cam.isApprox(
        correction.T_body_rig * right.rig().stereo.cameras[c].T_body_cam));
  CHECK(open_folder(folder.root(), {.part = {.from_s = 0.1}, .correction = correction})
            .pair_count() == 6);
}

TEST_CASE("Lists without a usable row are refused") {
  struct Case {
    const char *file, *text, *message;
  };
  const Case c = GENERATE(
      Case{"cam0/data.csv", "#timestamp [ns],filename\n", "data.csv: lists no image"},
      Case{"imu0/data.csv", "nonsense\n1,2,3\n",
           "holds no inertial sample; 1 malformed rows, first: FILE line 2: 3 fields, expected 7"},
      Case{"imu0/data.csv", "10,nan,0,0,0,0,9.8\n20,0,0,0,0,0,inf\n0.5,0,0,0,0,0,9.8\n",
           "FILE: holds no inertial sample; 1 malformed rows, first: FILE line 3: 0.5 is not a "
           "stamp "
           "in nanoseconds; 2 inertial samples with NaN or infinity, first: FILE line 1: not "
           "finite"},
      Case{"cam1/data.csv", "10.05,a.png\n10.1,b.png\n",
           "lists no image; 2 malformed rows, first: FILE line 1: 10.05 is not a stamp in "
           "nanoseconds"},
      Case{"cam1/data.csv", "55,55.png\n", "no image of cam0 has one of cam1 within 0.001000 s"});
  CAPTURE(c.file, c.text);
  const EurocFolder folder;
  folder.write(c.file, c.text);
  std::string message = c.message;
  for (std::size_t at = 0; (at = message.find("FILE")) != message.npos;)
    message.replace(at, 4, (folder.mav0() / c.file).string());
  CHECK_THROWS_WITH(open_folder(folder.root()), EndsWith(message));
}

TEST_CASE("Repeated rows and images without a partner are skipped and counted") {
  const EurocFolder folder;
  const std::string row = "10150000000,10150000000.png\n";  // line 5
  folder.replace("cam0/data.csv", row, row + row);
  Outcome outcome = read(folder);
  CHECK(outcome.packets.size() == 8);
  CHECK(outcome.report.count(ReaderFault::kRepeatedStamp) == 1);
  CHECK_THAT(first_of(outcome.report, ReaderFault::kRepeatedStamp),
             EndsWith("cam0/data.csv line 6: 10150000000"));
  folder.replace("cam1/data.csv", row, "");
  outcome = read(folder);
  CHECK(outcome.packets.size() == 7);
  CHECK_THAT(first_of(outcome.report, ReaderFault::kLeftWithoutRight),
             EndsWith("cam0/data.csv line 5: 10150000000.png"));
}

TEST_CASE("A gap between inertial samples is reported and the pairs are kept") {
  const EurocFolder folder;
  std::string text = folder.read("imu0/data.csv");
  const auto begin = text.find("10110000000");
  text.erase(begin, text.find("10145000000") - begin);
  folder.write("imu0/data.csv", text);
  const Outcome outcome = read(folder);
  CHECK(outcome.packets.size() == 8);
  CHECK(outcome.report.count(ReaderFault::kImuGap) == 1);
  CHECK_THAT(first_of(outcome.report, ReaderFault::kImuGap),
             Contains("0.040000 s after 10105000000"));
}

TEST_CASE("Pairs outside the inertial samples are skipped") {
  const EurocFolder folder;
  std::string text = folder.read("imu0/data.csv");
  SECTION("start late") {
    const auto begin = text.find("8500000000");
    text.erase(begin, text.find("10055000000") - begin);
  }
  SECTION("end early") {
    text.erase(text.find("10300000000"));
  }
  folder.write("imu0/data.csv", text);
  const Outcome outcome = read(folder);
  CHECK(outcome.packets.size() == 6);
  CHECK(outcome.report.count(ReaderFault::kPairWithoutImu) == 2);
}

TEST_CASE("The rig has the numbers of the sensor files") {
  const EurocFolder folder;
  const SensorRig rig = read_euroc_rig(folder.mav0());
  const Camera& left = rig.stereo.cameras[0];
  CHECK(left.width == 32);
  CHECK(left.height == 24);
  CHECK(left.fx == 30.0);
  CHECK(left.fy == 31.0);
  CHECK(left.cx == 16.0);
  CHECK(left.cy == 12.0);
  CHECK(left.lens == Lens(LensModel::kRadialTangential, {-0.2, 0.05, 0.001, 0.002}));
  CHECK(left.T_body_cam.linear() * Eigen::Vector3d::UnitX() == Eigen::Vector3d::UnitY());
  CHECK(left.T_body_cam.translation() == Eigen::Vector3d(0.0, 0.2, 0.3));
  CHECK(rig.stereo.baseline_m() == Approx(0.1));
  CHECK(rig.imu.gyro_noise_density == 1.6e-4);
  CHECK(rig.imu.gyro_random_walk == 1.9e-5);
  CHECK(rig.imu.accel_noise_density == 2.0e-3);
  CHECK(rig.imu.accel_random_walk == 3.0e-3);
  CHECK(rig.imu.rate_hz == 200.0);
}

TEST_CASE("The body is the inertial sensor, and a rotation with rounded digits is made exact") {
  const EurocFolder folder;
  folder.write("cam0/sensor.yaml", "%YAML:1.0\n" + EurocFolder::camera_yaml(0.0));  // OpenCV's
  folder.replace("cam0/sensor.yaml", "0, -1, 0,", "0, -1.00003, 0,");
  folder.replace("imu0/sensor.yaml", "1, 0, 0, 0, 0, 1", "1, 0, 0, 0.5, 0, 1");
  const SensorRig rig = read_euroc_rig(folder.mav0());
  const SE3& T_body_left = rig.stereo.cameras[0].T_body_cam;
  CHECK(T_body_left.translation().isApprox(Eigen::Vector3d(-0.5, 0.2, 0.3)));
  CHECK((T_body_left.linear() * T_body_left.linear().transpose() - Eigen::Matrix3d::Identity())
            .norm() < 1e-14);
  CHECK(rig.stereo.baseline_m() == Approx(0.1));
}

TEST_CASE("An impossible calibration is refused with file and line") {
  struct Case {
    std::string sensor, from, to, message;
  };
  const Case c = GENERATE(
      Case{"cam1", "0, -1, 0,", "0, -1.1, 0,",
           "line 5: T_BS is not a rotation: |R R^T - I| = 0.210000, at most 0.001000"},
      Case{"cam1", "0, -1, 0,", "0, 1, 0,", "line 5: T_BS is a reflection"},
      Case{"cam1", "0, 0, 0, 1]", "0, 0, 0, 2]", "line 5: T_BS: last row"},
      Case{"cam1", "0, 0, 0, 1]", "0, 0, 0]", "line 5: T_BS has 15 numbers, expected 16"},
      Case{"cam1", "0, 0, 0, 1]", "0, 0, .nan, 1]", "line 7: T_BS contains an element"},
      Case{"cam0", "0.2, 0", "1e300, 0", "T_BS: a translation of 1e+300 m is outside"},
      Case{"cam1", "T_BS:", "T_XX:", ": key T_BS is missing"},
      Case{"cam1", "0, -1, 0, 0.1", "0, -1, 0, 0.0", "where the left one is"},
      Case{"cam1", "pinhole", "fov",
           "line 10: camera_model 'fov' is not supported, only pinhole, omni, ds and eucm"},
      Case{"cam1", "pinhole", "omni",
           "line 11: intrinsics has 4 numbers, expected 5 (xi, fu, fv, cu, cv)"},
      Case{"cam1", "radial-tangential", "fov",
           "line 12: distortion_model 'fov' is not supported with"},
      Case{"cam1", "radial-tangential", "none", "line 13: distortion_coefficients are given, but"},
      Case{"cam1", "0.001, 0.002]", "0.001, 0.002, 0.1, 0.1]",
           "line 13: distortion_coefficients has 6 numbers, expected 4, 5 or 8"},
      Case{"cam0", "[-0.2,", "[1e300,", "line 13: distortion_coefficients: 1e+300 is outside"},
      Case{"cam1", "[32, 24]", "[32, 0]", "line 9: resolution"},
      Case{"cam1", "[32, 24]", "[32.5, 24]", "line 9: resolution"},
      Case{"cam1", "[32, 24]", "32", "line 9: resolution is not a list"},
      Case{"cam0", "[32, 24]", "[65536, 65536]", "line 9: resolution: more than 1e+08 pixels"},
      Case{"cam1", "[30.0,", "[-30.0,", "line 11: intrinsics: a focal length"},
      Case{"cam0", "[30.0,", "[1e300,", "line 11: intrinsics: a focal length of 1e+300 px"},
      Case{"cam0", "12.0]", "-1e9]", "line 11: intrinsics: a principal point at -1e+09 px"},
      Case{"cam1", "resolution:", "resolution", "line "},
      Case{"imu0", "1.6e-04", "0", "line 5: gyroscope_noise_density is not a number within"},
      Case{"imu0", "1.6e-04", "1e-300", "line 5: gyroscope_noise_density is not a number within"},
      Case{"imu0", "1.9e-05", "1e300", "line 6: gyroscope_random_walk is not a number within"},
      Case{"imu0", "2.0e-3", "-1", "line 7: accelerometer_noise_density"},
      Case{"imu0", "3.0e-3", ".nan", "line 8: accelerometer_random_walk"},
      Case{"imu0", "rate_hz: 200", "rate_hz: 1e300", "line 4: rate_hz is not a number within 1"});
  CAPTURE(c.sensor, c.from, c.to);
  const EurocFolder folder;
  folder.replace(c.sensor + "/sensor.yaml", c.from, c.to);
  CHECK_THROWS_WITH(read_euroc_rig(folder.mav0()),
                    Contains(c.sensor + "/sensor.yaml") && Contains(c.message));
}

}  // namespace km
