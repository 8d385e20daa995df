#include <catch2/catch.hpp>

#include "modules/sensors/frame_files.hpp"
#include "modules/sensors/node/euroc_rig.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

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

// Checks that seven pairs remain and that the report contains only this fault, with `text` in its
// example.
void check_one_pair_less(const EurocFolder& folder, ReaderFault fault, const std::string& text) {
  const Outcome outcome = read(folder);
  CHECK(outcome.packets.size() == EurocFolder::kPairs - 1);
  CHECK(outcome.report.entries().size() == 1);
  CHECK(outcome.report.count(fault) == 1);
  CHECK_THAT(first_of(outcome.report, fault), Catch::Contains(text));
}

}  // namespace

TEST_CASE("A recording without faults gives every pair and every sample between them",
          "[sensors]") {
  const EurocFolder folder(GENERATE(".png", ".jpg"));
  EurocReader reader = open_euroc(folder.root());
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

TEST_CASE("The folder mav0 itself is accepted", "[sensors]") {
  const EurocFolder folder;
  CHECK(open_euroc(folder.mav0()).pair_count() == EurocFolder::kPairs);
}

TEST_CASE("The first packet begins one second before its frame and before the window",
          "[sensors]") {
  const EurocFolder folder;
  EurocReader reader = open_euroc(folder.root(), {.from_s = 0.1});
  const auto packet = reader.next();
  REQUIRE(packet);
  CHECK(packet->frame->stamp == EurocFolder::image_stamp(2));
  CHECK(packet->imu.front().stamp == packet->frame->stamp - 1'000'000'000);
  CHECK(packet->imu.size() == 201);
}

TEST_CASE("A window is half open and counts from the recording's first image", "[sensors]") {
  const EurocFolder folder;
  EurocReader first = open_euroc(folder.root(), {.from_s = 0.0, .to_s = 0.2});
  EurocReader second = open_euroc(folder.root(), {.from_s = 0.2, .to_s = 100.0});
  const auto a = packets_of(first);
  const auto b = packets_of(second);
  REQUIRE(a.size() == 4);
  REQUIRE(b.size() == 4);
  CHECK(a.back().frame->stamp == EurocFolder::image_stamp(3));
  CHECK(b.front().frame->stamp == EurocFolder::image_stamp(4));
  CHECK(second.recording_start() == EurocFolder::kFirstImage);
  CHECK(second.first_stamp() == EurocFolder::image_stamp(4));
  CHECK(second.last_stamp() == EurocFolder::image_stamp(7));
  CHECK_THROWS_AS(open_euroc(folder.root(), {.from_s = 1.0, .to_s = 1.0}), std::invalid_argument);
  CHECK_THROWS_AS(open_euroc(folder.root(), {.from_s = std::nan("")}), std::invalid_argument);
  CHECK_THROWS_WITH(open_euroc(folder.root(), {.from_s = 1.0}),
                    Catch::Contains("from 0 s to 0.35 s"));
}

TEST_CASE("Blanks, comments, CRLF and a bare header in the lists are accepted", "[sensors]") {
  const EurocFolder folder;
  std::string list = "timestamp [ns] , filename\r\n";
  for (int i = 0; i < EurocFolder::kPairs; ++i) {
    const std::string stamp = std::to_string(EurocFolder::image_stamp(i));
    list += "  " + stamp + " ,  " + stamp + ".png  # note\r\n\r\n";
  }
  folder.write("cam0/data.csv", list);
  EurocReader reader = open_euroc(folder.root());
  CHECK(packets_of(reader).size() == EurocFolder::kPairs);
  CHECK(reader.report().empty());
}

TEST_CASE("Stamps of left and right may differ by the tolerance", "[sensors]") {
  const EurocFolder folder;
  folder.replace("cam1/data.csv", "10100000000,", "10100000400,");
  CHECK(open_euroc(folder.root(), {.stereo_tolerance_s = 1e-6}).pair_count() == 8);
  EurocReader strict = open_euroc(folder.root(), {.stereo_tolerance_s = 1e-7});
  CHECK(strict.pair_count() == 7);
  CHECK(strict.report().count(ReaderFault::kLeftWithoutRight) == 1);
  CHECK(strict.report().count(ReaderFault::kRightWithoutLeft) == 1);
}

TEST_CASE("MH_01_easy: 320 pairs in 16 s, one step of 100 ms, covered by samples", "[sensors]") {
  const auto folder = shared_data("euroc/MH_01_easy");
  if (!folder) return;
  EurocReader reader = open_euroc(*folder, {.from_s = 0.0, .to_s = 16.01});
  const auto packets = packets_of(reader);
  REQUIRE(packets.size() == 320);
  CHECK(reader.report().empty());
  check_imu_contract(packets);
  int long_steps = 0;
  for (std::size_t i = 1; i < packets.size(); ++i) {
    const double step_s = seconds_between(packets[i - 1].frame->stamp, packets[i].frame->stamp);
    if (step_s > 0.06) {
      ++long_steps;
      CHECK(step_s == Approx(0.1).margin(1e-6));
      CHECK(packets[i].imu.size() == 21);
    }
  }
  CHECK(long_steps == 1);
  CHECK(packets.front().imu.size() == 201);
  CHECK(packets.front().frame->left.width == 752);
  CHECK(reader.rig().stereo.baseline_m() == Approx(0.110).margin(0.001));  // README of the data
}

TEST_CASE("Missing files and folders are refused by name", "[sensors]") {
  const EurocFolder folder;
  CHECK_THROWS_WITH(open_euroc("/nowhere/at/all"), "/nowhere/at/all: no such folder");
  for (const std::string file : {"cam0/data.csv", "cam1/data.csv", "imu0/data.csv",
                                 "cam0/sensor.yaml", "cam1/sensor.yaml", "imu0/sensor.yaml"}) {
    CAPTURE(file);
    const EurocFolder corrupted;
    fs::remove(corrupted.mav0() / file);
    CHECK_THROWS_WITH(open_euroc(corrupted.root()),
                      Catch::StartsWith((corrupted.mav0() / file).string() + ": no such file"));
  }
  fs::remove_all(folder.mav0() / "cam1");
  for (const fs::path& path : {folder.root(), folder.mav0()})
    CHECK_THROWS_WITH(open_euroc(path), Catch::Contains("cam1/sensor.yaml: no such file") &&
                                            Catch::Contains("nor depth0"));
  fs::remove_all(folder.mav0());
  CHECK_THROWS_WITH(open_euroc(folder.root()),
                    Catch::EndsWith("neither a folder mav0 nor cam0 in it: not a recording in the "
                                    "layout of EuRoC, KITTI, TUM RGB-D or 7-Scenes"));
  for (const char* robot : {"robot1", "robot0", "robot2/none"})
    fs::create_directories(folder.root() / robot / (robot[5] < '2' ? "mav0" : "cam0"));
  CHECK_THROWS_WITH(open_euroc(folder.root()), Catch::EndsWith("in it are robot0, robot1"));
}

TEST_CASE("A recording needs no inertial sensor", "[sensors]") {
  const EurocFolder folder;
  const EurocOptions options{.imu = false};
  const SE3 T_imu_left = open_euroc(folder.root()).rig().stereo.cameras[0].T_body_cam;
  SECTION("an existing inertial sensor defines the body") {}
  SECTION("without an inertial sensor the body is the reference of all poses of sensors") {
    fs::remove_all(folder.mav0() / "imu0");
    CHECK_FALSE(open_euroc(folder.root()).rig().has_imu);
    CHECK(open_euroc(folder.mav0()).pair_count() == EurocFolder::kPairs);
  }
  EurocReader reader = open_euroc(folder.root(), options);
  CHECK_FALSE(reader.rig().has_imu);
  CHECK(
      reader.rig().stereo.cameras[0].T_body_cam.isApprox(T_imu_left));  // its T_BS is the identity
  const auto packets = packets_of(reader);
  REQUIRE(packets.size() == EurocFolder::kPairs);
  for (const SensorPacket& packet : packets) CHECK(packet.imu.empty());
  CHECK(reader.report().empty());
}

TEST_CASE("A correction moves the stamps of images and the cameras", "[sensors]") {
  const EurocFolder folder;
  folder.add_depth();
  EurocReader right = open_euroc(folder.root());
  const CameraCalibration correction{0.0125,
                                     make_pose(Eigen::Matrix3d::Identity(), {0.1, 0.2, 0.3})};
  EurocReader corrected = open_euroc(folder.root(), {.correction = correction, .depth = true});
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
  CHECK(open_euroc(folder.root(), {.from_s = 0.1, .correction = correction}).pair_count() == 6);
}

TEST_CASE("Lists without a usable row are refused", "[sensors]") {
  const EurocFolder folder;
  SECTION("images") {
    folder.write("cam0/data.csv", "#timestamp [ns],filename\n");
    CHECK_THROWS_WITH(open_euroc(folder.root()), Catch::EndsWith("data.csv: lists no image"));
  }
  SECTION("inertial samples") {
    folder.write("imu0/data.csv", "nonsense\n1,2,3\n");
    CHECK_THROWS_WITH(open_euroc(folder.root()),
                      Catch::Contains("holds no inertial sample; 1 malformed rows, first: ") &&
                          Catch::EndsWith("line 2: 3 fields, expected 7"));
  }
  SECTION("inertial samples whose values are not numbers") {
    folder.write("cam0/data.csv", folder.read("cam0/data.csv") + "nonsense,a\n");
    folder.write("imu0/data.csv", "10,nan,0,0,0,0,9.8\n20,0,0,0,0,0,inf\n0.5,0,0,0,0,0,9.8\n");
    const std::string list = (folder.mav0() / "imu0/data.csv").string();
    CHECK_THROWS_WITH(open_euroc(folder.root()),
                      list + ": holds no inertial sample; 1 malformed rows, first: " + list +
                          " line 3: 0.5 is not a stamp in nanoseconds; 2 inertial samples with "
                          "NaN or infinity, first: " +
                          list + " line 1: not finite");
  }
  SECTION("images with stamps in seconds") {
    folder.write("cam1/data.csv", "10.05,a.png\n10.1,b.png\n");
    CHECK_THROWS_WITH(open_euroc(folder.root()),
                      Catch::Contains("cam1/data.csv: lists no image; 2 malformed rows, first: ") &&
                          Catch::EndsWith("line 1: 10.05 is not a stamp in nanoseconds"));
  }
  SECTION("no pairs") {
    folder.write("cam1/data.csv", "55,55.png\n");
    CHECK_THROWS_WITH(open_euroc(folder.root()), Catch::Contains("no image of cam0"));
  }
}

TEST_CASE("A truncated JPEG is not accepted as an image", "[sensors]") {
  const EurocFolder folder(".jpg");
  fs::path image = folder.image("cam0", 0);
  image.replace_extension(".jpg");
  fs::resize_file(image, fs::file_size(image) * 2 / 3);
  check_one_pair_less(folder, ReaderFault::kUnreadableImage, "truncated image");
}

TEST_CASE("Faulty rows of an image list are skipped and counted with their line", "[sensors]") {
  const EurocFolder folder;
  const std::string row = "10150000000,10150000000.png\n";  // line 5
  SECTION("repeated") {
    for (const std::string camera : {"cam0/data.csv", "cam1/data.csv"})
      folder.replace(camera, row, row + row);
    const Outcome outcome = read(folder);
    CHECK(outcome.packets.size() == 8);
    CHECK(outcome.report.count(ReaderFault::kRepeatedStamp) == 2);
    CHECK_THAT(first_of(outcome.report, ReaderFault::kRepeatedStamp),
               Catch::EndsWith("cam0/data.csv line 6: 10150000000"));
  }
  SECTION("out of order") {
    folder.replace("cam0/data.csv", row, row + "10000000001,x.png\n");
    const Outcome outcome = read(folder);
    CHECK(outcome.packets.size() == 8);
    CHECK_THAT(first_of(outcome.report, ReaderFault::kUnorderedStamp),
               Catch::EndsWith("line 6: 10000000001 comes after 10150000000"));
  }
  SECTION("not a stamp") {
    folder.replace("cam0/data.csv", "10150000000,", "abc,");
    const Outcome outcome = read(folder);
    CHECK(outcome.packets.size() == 7);
    CHECK_THAT(first_of(outcome.report, ReaderFault::kMalformedRow),
               Catch::EndsWith("line 5: abc is not a stamp in nanoseconds"));
    CHECK(outcome.report.count(ReaderFault::kRightWithoutLeft) == 1);
  }
  SECTION("no name") {
    folder.replace("cam0/data.csv", row, "10150000000\n");
    const Outcome outcome = read(folder);
    CHECK_THAT(first_of(outcome.report, ReaderFault::kMalformedRow),
               Catch::EndsWith("line 5: 1 fields, expected 2"));
  }
  SECTION("left without right") {
    folder.replace("cam1/data.csv", row, "");
    check_one_pair_less(folder, ReaderFault::kLeftWithoutRight,
                        "cam0/data.csv line 5: 10150000000.png");
  }
}

TEST_CASE("The sample after a faulty one completes the packet", "[sensors]") {
  const EurocFolder folder;
  folder.replace("imu0/data.csv", "10100000000,0.1", "10100000000,nan");  // at the third image
  const Outcome outcome = read(folder);
  REQUIRE(outcome.packets.size() == 8);
  CHECK_THAT(first_of(outcome.report, ReaderFault::kNotFinite),
             Catch::Contains("imu0/data.csv line 322"));
  CHECK(outcome.packets[2].imu.back().stamp == 10'105'000'000);
}

TEST_CASE("A gap between inertial samples is reported and the pairs are kept", "[sensors]") {
  const EurocFolder folder;
  std::string text = folder.read("imu0/data.csv");
  const auto begin = text.find("10110000000");
  text.erase(begin, text.find("10145000000") - begin);
  folder.write("imu0/data.csv", text);
  const Outcome outcome = read(folder);
  CHECK(outcome.packets.size() == 8);
  CHECK(outcome.report.count(ReaderFault::kImuGap) == 1);
  CHECK_THAT(first_of(outcome.report, ReaderFault::kImuGap),
             Catch::Contains("0.040000 s after 10105000000"));
}

TEST_CASE("Pairs outside the inertial samples are skipped", "[sensors]") {
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

TEST_CASE("The report reads as one line per kind of fault", "[sensors]") {
  ReaderReport report;
  CHECK(to_string(report).empty());
  report.add(ReaderFault::kMissingImage, "a.csv line 7: x.png");
  report.add(ReaderFault::kMissingImage, "a.csv line 9: y.png");
  CHECK(to_string(report) == "2 missing images, first: a.csv line 7: x.png\n");
}

TEST_CASE("Keyframes listed in pairs.csv load as stereo pairs", "[sensors]") {
  const EurocFolder folder;
  folder.write_image("7_0.png", 32, 24, 50);
  folder.write_image("7_1.png", 32, 24, 60);
  folder.write("pairs.csv", "#timestamp [ns],left,right\n7,7_0.png,7_1.png\n7,a,b\n9,9_0.png\n");
  ReaderReport report;
  const auto pairs = list_keyframe_pairs(folder.mav0(), report);
  REQUIRE(pairs.size() == 1);
  CHECK(report.count(ReaderFault::kRepeatedStamp) == 1);
  CHECK(report.count(ReaderFault::kMalformedRow) == 1);
  const auto loaded = load_stereo_pair(pairs[0], read_euroc_rig(folder.mav0()).stereo);
  REQUIRE(loaded.status == ImageStatus::kOk);
  CHECK(loaded.frame.stamp == 7);
  CHECK(loaded.frame.left.pixels.front() == 50);
  CHECK(loaded.frame.right.pixels.front() == 60);
}

TEST_CASE("V1_01_easy: all 100 keyframes load with the rig of the recording", "[sensors]") {
  const auto folder = shared_data("euroc/V1_01_easy");
  if (!folder) return;
  ReaderReport report;
  const StereoRig rig = read_euroc_rig(*folder / "mav0").stereo;
  const auto pairs = list_keyframe_pairs(*folder / "keyframes", report);
  REQUIRE(pairs.size() == 100);
  CHECK(report.empty());
  for (const StereoPairFile& pair : pairs) {
    const auto loaded = load_stereo_pair(pair, rig);
    CAPTURE(loaded.problem);
    CHECK(loaded.status == ImageStatus::kOk);
  }
}

}  // namespace km
