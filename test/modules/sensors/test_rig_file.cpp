#include <catch2/catch.hpp>

#include "modules/sensors/rig_file_codec.hpp"
#include "test/modules/sensors/euroc_folder.hpp"

namespace km {
namespace {

using Catch::Matchers::Contains;

const std::string kStereo =
    "left: {topic: /cam0}\nright: {topic: /cam1}\nimu: {topic: /imu0}\n"
    "calibration: recording\ncamera_time_offset_s: -0.003\n";

std::string complaint(const std::string& text) try {
  const TemporaryFolder folder;
  static_cast<void>(read_rig_file(folder.write("rig.yaml", text)));
  return "";
} catch (const ConfigError& error) {
  return error.what();
}

TEST_CASE("A rig file names topics, and a calibration beside it", "[sensors]") {
  const EurocFolder recording;
  const TemporaryFolder folder;
  std::filesystem::create_directory_symlink(recording.root(), folder.path() / "recording");
  const Rig rig = read_rig_file(folder.write("rig.yaml", kStereo));
  CHECK(rig.topics.left == "/cam0");
  CHECK(rig.topics.right == "/cam1");
  CHECK(rig.topics.imu == "/imu0");
  CHECK(rig.topics.gyro.empty());
  CHECK(rig.camera_time_offset_s == -0.003);
  CHECK(rig.sensors.stereo.cameras[0].width == 32);
  CHECK(rig.sensors.stereo.baseline_m() == Approx(0.1));
}

TEST_CASE("What a rig file lacks is named by file and line", "[sensors]") {
  CHECK_THAT(complaint("left: {topic: /a}\nimu: {topic: /i}\ncalibration: /\n"),
             Contains("one camera does not tell how far things are"));
  CHECK_THAT(complaint("left: {topic: /a}\nright: {topic: /b}\nimu: {gyro_topic: /g}\n"
                       "calibration: /\n"),
             Contains("rig.yaml:3") && Contains("gyro_topic and accel_topic"));
  CHECK_THAT(complaint("left: {topic: /a}\nright: {topic: /b}\nimu: {topic: /i}\n"),
             Contains("calibration"));
  CHECK_THAT(complaint("left: {topik: /a}\nright: {topic: /b}\nimu: {topic: /i}\n"
                       "calibration: /\n"),
             Contains("rig.yaml:1") && Contains("did you mean topic?"));
}

}  // namespace
}  // namespace km
