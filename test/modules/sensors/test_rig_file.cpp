#include "modules/core/geometry/lie.hpp"
#include "modules/sensors/node/rig_file.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

std::string complaint(const std::string& text) try {
  const TemporaryFolder folder;
  static_cast<void>(read_rig_file(folder.write("rig.yaml", text)));
  return "";
} catch (const ConfigError& error) {
  return error.what();
}

const std::string kChain =
    "cam0: {T_cam_imu: [[1,0,0,0], [0,1,0,0], [0,0,1,0], [0,0,0,1]], camera_model: pinhole,\n"
    "  distortion_model: radtan, distortion_coeffs: [0,0,0,0], intrinsics: [300,300,320,240],\n"
    "  resolution: [640,480], timeshift_cam_imu: 0.02, rostopic: /cam0}\n"
    "cam1: {T_cam_imu: [[1,0,0,-0.2], [0,1,0,0], [0,0,1,0], [0,0,0,1]], camera_model: pinhole,\n"
    "  distortion_model: radtan, distortion_coeffs: [0,0,0,0], intrinsics: [310,310,320,240],\n"
    "  resolution: [640,480], timeshift_cam_imu: 0.02, rostopic: /cam1}\n";
const std::string kTopics = "left: {topic: /cam0}\nright: {topic: /cam1}\nimu: {topic: /imu0}\n";

PartialRig read(const TemporaryFolder& folder, const std::string& text) {
  return read_rig_file(folder.write("rig.yaml", text));
}

TEST_CASE("A rig file names the files of Kalibr or contains their keys") {
  const TemporaryFolder folder;
  folder.write("camchain.yaml", kChain);
  folder.write("imu.yaml",
               "update_rate: 400\naccelerometer_noise_density: 0.006\n"
               "accelerometer_random_walk: 0.0002\ngyroscope_noise_density: 0.0004\n"
               "gyroscope_random_walk: 4.0e-06\n");
  const PartialRig named = read(folder, kTopics + "calibration: [camchain.yaml, imu.yaml]\n");
  CHECK(named.is_complete());
  CHECK(named.rig.sensors.imu.rate_hz == 400.0);
  CHECK(named.rig.sensors.stereo.cameras[1].fx == 310.0);
  CHECK(named.rig.notes.empty());
  // t_imu = t_cam + timeshift_cam_imu, unless the rig file states another value.
  CHECK(named.rig.camera_time_offset_s == 0.02);
  CHECK(read(folder, kTopics + "calibration: camchain.yaml\ncamera_time_offset_s: 0\n")
            .rig.camera_time_offset_s == 0.0);

  std::string indented;
  for (std::size_t at = 0; at < kChain.size();) {
    const std::size_t end = kChain.find('\n', at) + 1;
    indented += "  " + kChain.substr(at, end - at);
    at = end;
  }
  const PartialRig written = read(folder, kTopics + "calibration:\n" + indented);
  CHECK(written.is_complete());
  CHECK(written.rig.sensors.stereo.baseline_m() == Approx(0.2));
  CHECK_THROWS_WITH(read(folder, kTopics + "calibration:\n  cam0: {resolution: 3}\n"),
                    Contains("rig.yaml line 5: resolution is not a list of numbers"));
  // The calibration names other topics, so it may be that of other cameras.
  const PartialRig other = read(folder,
                                "left: {topic: /a}\nright: {topic: /cam1}\n"
                                "imu: {topic: /imu0}\ncalibration: camchain.yaml\n");
  REQUIRE(other.rig.notes.size() == 2);
  CHECK_THAT(other.rig.notes[1], Contains("/a is calibrated as /cam0"));
}

TEST_CASE("A rig file for depth needs no calibration of depth") {
  const EurocFolder recording;
  const TemporaryFolder folder;
  fs::create_directory_symlink(recording.root(), folder.path() / "recording");
  const PartialRig rig =
      read(folder,
           "left: {topic: /color}\ndepth: {topic: /depth, min_range_m: 0.4, max_range_m: 6, "
           "baseline_m: 0.05}\nimu: {topic: /imu}\ncalibration: recording\n");
  CHECK(rig.has_cameras);
  CHECK_FALSE(rig.is_complete());  // messages show whether depth is aligned
  CHECK(rig.rig.sensors.stereo.depth_source == DepthSource::kDepthImage);
  CHECK(rig.rig.sensors.stereo.baseline_m() == Approx(0.05));
  REQUIRE(rig.rig.sensors.depth);
  CHECK(rig.rig.sensors.depth->min_m == 0.4);
  CHECK(rig.rig.sensors.depth->max_m == 6.0);
}

const CameraCalibration kCorrection{
    0.0123456789, make_pose(so3_exp({0.02, -0.01, 0.03}), {0.004, -0.005, 0.006})};

TEST_CASE("A corrected rig file gives the rig of the original with the correction") {
  const EurocFolder recording;
  const TemporaryFolder folder, elsewhere;
  fs::create_directory_symlink(recording.root(), folder.path() / "recording");
  const bool is_inline = GENERATE(false, true);
  CAPTURE(is_inline);
  std::string text = kTopics;
  if (is_inline) {
    text += "calibration:\n";
    std::istringstream lines(kChain);
    for (std::string line; std::getline(lines, line);) text += "  " + line + '\n';
  } else {
    text += "calibration: recording\ncamera_time_offset_s: -0.003\n";
  }
  const auto base = folder.write("rig.yaml", text);
  CHECK(read_rig_file(base).T_body_rig.isApprox(SE3::Identity()));
  const std::string corrected = corrected_rig_text(base, kCorrection);
  const PartialRig rig = read_rig_file(elsewhere.write("rig_estimated.yaml", corrected));
  CHECK(rig.rig.camera_time_offset_s == kCorrection.offset_s);
  CHECK(rig.T_body_rig.isApprox(kCorrection.T_body_rig, 1e-9));
  CHECK(rig.rig.topics.right == "/cam1");
  CHECK(rig.rig.sensors.stereo.cameras[1].width == (is_inline ? 640 : 32));
  // Once more, from the written file.
  CHECK(corrected_rig_text(elsewhere.path() / "rig_estimated.yaml", kCorrection) == corrected);
}

TEST_CASE("A recording with its own rig accepts a file with only a correction") {
  const TemporaryFolder folder;
  const auto file = folder.write("rig.yaml", corrected_rig_text("", kCorrection));
  const CameraCalibration read = read_rig_correction(file);
  CHECK(read.offset_s == kCorrection.offset_s);
  CHECK(read.T_body_rig.isApprox(kCorrection.T_body_rig, 1e-9));
  CHECK_THROWS_WITH(read_rig_correction(folder.write("topics.yaml", kTopics)),
                    Contains("topics.yaml: left is for a bag or live topics: a EuRoC folder has "
                             "its own calibration"));
  CHECK_THROWS_WITH(read_rig_correction(folder.write("other.yaml", "lift: 1\n")),
                    Contains("other.yaml:1: unknown key lift"));
  CHECK_THROWS_WITH(read_rig_correction(folder.write("short.yaml", "T_body_rig: [1, 0, 0]\n")),
                    Contains("has not 16 numbers"));
  const std::string scaled = "T_body_rig: [2,0,0,0, 0,2,0,0, 0,0,2,0, 0,0,0,1]\n";
  CHECK_THROWS_WITH(read_rig_correction(folder.write("scaled.yaml", scaled)),
                    Contains("scaled.yaml: T_body_rig"));
}

TEST_CASE("Parts that a rig file lacks come from topics") {
  const TemporaryFolder folder;
  const PartialRig none =
      read(folder,
           "left: {topic: /l/image_raw/compressed}\n"
           "right: {topic: /r/image_rect, info_topic: /r/info}\nimu: {topic: /imu}\n"
           "body_frame: base\n");
  CHECK(!none.has_cameras);
  CHECK(!none.has_extrinsics);
  CHECK(none.info_topics == std::array<std::string, 2>{"/l/camera_info", "/r/info"});
  CHECK(none.images == std::array{RosImages::kRaw, RosImages::kRectified});
  CHECK(none.body_frame == "base");
  REQUIRE(none.rig.notes.size() == 1);
  CHECK_THAT(none.rig.notes[0], Contains("the noise of EuRoC's inertial sensor is used"));
  CHECK(read(folder, "left: {topic: /l}\nright: {topic: /r}\nodometry: {topic: /odom}\n")
            .rig.notes.empty());

  std::string chain = kChain;
  for (std::size_t at = 0; (at = chain.find("T_cam_imu")) != chain.npos;)
    chain.replace(at, 9, "T_cn_cnm1");
  folder.write("cameras.yaml", chain);
  const PartialRig unplaced = read(folder, kTopics + "calibration: cameras.yaml\n");
  CHECK(unplaced.has_cameras);
  CHECK(!unplaced.has_extrinsics);
  CHECK(unplaced.rig.sensors.stereo.cameras[1].T_body_cam.translation().isApprox(
      Eigen::Vector3d(0.2, 0, 0)));
}

TEST_CASE("A rig file may state poses of cameras that CameraInfo describes") {
  const TemporaryFolder folder;
  const std::string poses =
      "calibration:\n  cam0: {T_cam_imu: [[1,0,0,0.5], [0,1,0,0], [0,0,1,0], [0,0,0,1]]}\n";
  const std::string right =
      "  cam1: {T_cn_cnm1: [[1,0,0,-0.2], [0,1,0,0], [0,0,1,0], [0,0,0,1]]}\n";
  const PartialRig both = read(folder, kTopics + poses + right);
  CHECK_FALSE(both.has_cameras);
  CHECK(both.has_extrinsics);
  CHECK(both.has_pair);
  CHECK(both.rig.sensors.stereo.cameras[0].T_body_cam.translation().x() == -0.5);
  CHECK(both.rig.sensors.stereo.baseline_m() == Approx(0.2));
  const PartialRig left = read(folder, kTopics + poses);
  CHECK(left.has_extrinsics);
  CHECK_FALSE(left.has_pair);
  const PartialRig pair =
      read(folder, kTopics + "calibration:\n  cam0: {rostopic: /cam0}\n" + right);
  CHECK_FALSE(pair.has_extrinsics);
  CHECK(pair.has_pair);
  const PartialRig depth = read(folder,
                                "left: {topic: /cam0}\ndepth: {topic: /depth, max_range_m: 6}\n"
                                "imu: {topic: /imu0}\n" +
                                    poses);
  CHECK(depth.has_extrinsics);
  CHECK(depth.rig.sensors.depth->max_m == 6.0);
  // A camera with a part of its intrinsics is refused.
  CHECK_THROWS_WITH(read(folder, kTopics + poses + "  cam1: {intrinsics: [300,300,320,240]}\n"),
                    Contains("rig.yaml line"));
}

TEST_CASE("Without inertial sensor and odometry the body is the left camera") {
  const TemporaryFolder folder;
  std::string chain = kChain;  // Kalibr without an inertial sensor
  const std::string first = "T_cam_imu: [[1,0,0,0], [0,1,0,0], [0,0,1,0], [0,0,0,1]], ";
  chain.erase(chain.find(first), first.size());
  chain.replace(chain.find("T_cam_imu"), 9, "T_cn_cnm1");
  folder.write("camchain.yaml", chain);
  const PartialRig rig =
      read(folder, "left: {topic: /cam0}\nright: {topic: /cam1}\ncalibration: camchain.yaml\n");
  CHECK(rig.is_complete());
  const auto& cameras = rig.rig.sensors.stereo.cameras;
  CHECK(cameras[0].T_body_cam.isApprox(SE3::Identity()));
  CHECK(cameras[1].T_body_cam.translation().x() > 0.0);
}

TEST_CASE("A robot without an inertial sensor may name its odometry") {
  const TemporaryFolder folder;
  folder.write("camchain.yaml", kChain);
  folder.write("poses.tum", "1 0 0 0 0 0 0 1\n");
  const std::string cameras =
      "left: {topic: /cam0}\nright: {topic: /cam1}\ncalibration: camchain.yaml\n";
  const PartialRig topic =
      read(folder, cameras +
                       "odometry: {topic: /odom, T_child_body: [1,0,0,0.5, 0,1,0,0, 0,0,1,0, "
                       "0,0,0,1]}\n");
  CHECK(topic.rig.topics.odometry == "/odom");
  CHECK(topic.rig.T_child_body.translation().x() == 0.5);
  const PartialRig file = read(folder, cameras + "odometry: {file: poses.tum}\n");
  CHECK(file.pose_file == folder.path() / "poses.tum");
}

TEST_CASE("A missing or wrong key of a rig file is named by file and line") {
  const std::string pair = "left: {topic: /a}\nright: {topic: /b}\n";
  const auto [text, message] = GENERATE_COPY(table<std::string, std::string>(
      {{"left: {topic: /a}\nimu: {topic: /i}\n", "one camera does not measure distances"},
       {"left: {topic: /a}\ndepth: {topic: /d, min_range_m: 9, max_range_m: 8}\n",
        "rig.yaml:2: depth.min_range_m = 9 is not less than max_range_m"},
       {pair + "imu: {gyro_topic: /g}\n", "rig.yaml:3"},
       {pair + "imu: {topic: /i}\ncalibration: [nowhere.yaml]\n",
        "rig.yaml:4: calibration = [nowhere.yaml] is no file or folder"},
       {"left: {topik: /a}\nright: {topic: /b}\n", "did you mean topic?"},
       {pair + "odometry: {topic: /odom, T_child_body: [1, 2]}\n", "has not 16 numbers"},
       {pair + "odometry: {topic: /o, T_child_body: [2,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}\n",
        "odometry.T_child_body is not a rotation"}}));
  CAPTURE(text);
  CHECK_THAT(complaint(text), Contains(message));
}

}  // namespace
}  // namespace km
