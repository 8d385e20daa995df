#include <catch2/catch.hpp>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "modules/diagnosis/examine_sensors.hpp"
#include "modules/diagnosis/stereo_fit.hpp"
#include "modules/sensors/node/euroc_rig.hpp"
#include "test/support/demo_world.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// Data of a recording and its calibration; faults are inserted in either.
struct Recorded {
  SensorSample sample;
  SensorRig rig;
  ReaderReport report;
};

Recorded read(const fs::path& folder, double to_s) {
  EurocReader reader = open_euroc(folder, {.to_s = to_s});
  SensorSampler sampler;
  while (const auto packet = reader.next()) sampler.add(*packet);
  return {sampler.sample(), reader.rig(), reader.report()};
}

// 12 s of MH_01, moved by hand; read once.
const std::optional<Recorded>& machine_hall() {
  static const std::optional<Recorded> recorded = [] {
    const auto folder = shared_data("euroc/MH_01_easy");
    return folder ? std::optional(read(*folder, 12.0)) : std::nullopt;
  }();
  return recorded;
}

// The ids of all findings, including notes.
std::set<std::string> found_in(const Recorded& recorded) {
  Examination result = examine_streams(recorded.sample, recorded.report);
  result.add(examine_images(recorded.sample));
  result.add(examine_stereo(recorded.sample, recorded.rig.stereo));
  result.add(examine_inertial(recorded.sample, recorded.rig.stereo));
  UNSCOPED_INFO(to_text(result.figures) << to_text(result.findings));
  std::set<std::string> ids;
  for (const Finding& finding : result.findings) ids.insert(finding.id);
  return ids;
}

using Ids = std::set<std::string>;

void scale_focal(StereoRig& rig, double factor) {
  for (Camera& camera : rig.cameras) camera.fx *= factor, camera.fy *= factor;
}

void rotate_gyro(SensorSample& sample, const std::function<void(Eigen::Vector3d&)>& change) {
  for (ImuSample& measured : sample.imu) change(measured.gyro);
}

// A EuRoC folder of links to images of V1_01. In the data they are separate from their calibration.
void link_v1(const fs::path& recording, const fs::path& folder,
             const std::function<fs::path(int camera)>& images,
             const std::function<bool(int camera, const std::string& file)>& is_of) {
  fs::create_directories(folder / "mav0");
  fs::create_directory_symlink(fs::absolute(recording / "mav0/imu0"), folder / "mav0/imu0");
  for (const int camera : {0, 1}) {
    const fs::path made = folder / "mav0" / ("cam" + std::to_string(camera));
    fs::create_directories(made);
    fs::create_symlink(fs::absolute(recording / "mav0" / made.filename() / "sensor.yaml"),
                       made / "sensor.yaml");
    fs::create_directory_symlink(fs::absolute(images(camera)), made / "data");
    std::map<std::string, std::string> rows;
    for (const auto& file : fs::directory_iterator(made / "data"))
      if (const std::string name = file.path().filename(); is_of(camera, name))
        rows[name.substr(0, 19)] = name;
    std::ofstream list(made / "data.csv");
    for (const auto& [stamp, name] : rows) list << stamp << ',' << name << '\n';
  }
}

}  // namespace

TEST_CASE("MH_01 gives no findings", "[diagnosis]") {
  if (!machine_hall()) return;
  CHECK(found_in(*machine_hall()).empty());
}

TEST_CASE("A fault in the calibration of MH_01 is the only finding", "[diagnosis]") {
  if (!machine_hall()) return;
  Recorded recorded = *machine_hall();
  StereoRig& rig = recorded.rig.stereo;
  const auto turn_left = [&rig](const Eigen::Matrix3d& R) {
    rig.cameras[0].T_body_cam.linear() = R;
  };
  SECTION("the pair inverted") {
    rig = undone(rig, StereoFault::kInvertedPair);
    CHECK(found_in(recorded) == Ids{"stereo.inverted"});
  }
  SECTION("both T_BS inverted and so the camera's rotation to the inertial sensor") {
    rig = undone(rig, StereoFault::kInvertedCameras);
    CHECK(found_in(recorded) == Ids{"stereo.inverted_cameras", "extrinsics.inverted"});
  }
  SECTION("the right T_BS inverted") {
    rig = undone(rig, StereoFault::kInvertedRight);
    CHECK(found_in(recorded) == Ids{"stereo.inverted_right"});
  }
  SECTION("the rotation of both to the body inverted without their relative pose") {
    const SE3 T_left_right = rig.T_left_right();
    turn_left(rig.cameras[0].T_body_cam.linear().transpose());
    rig.cameras[1].T_body_cam = rig.cameras[0].T_body_cam * T_left_right;
    CHECK(found_in(recorded) == Ids{"extrinsics.inverted"});
  }
  SECTION("cameras turned by 3 degrees against the body") {
    const SE3 T_left_right = rig.T_left_right();
    turn_left(Eigen::AngleAxisd(3.0 / kDegrees, Eigen::Vector3d(1.0, 1.0, 0.0).normalized()) *
              rig.cameras[0].T_body_cam.linear());
    rig.cameras[1].T_body_cam = rig.cameras[0].T_body_cam * T_left_right;
    CHECK(found_in(recorded) == Ids{"extrinsics.rotation"});
  }
  SECTION("a focal length of both cameras 3 % too short") {
    scale_focal(rig, 0.97);
    CHECK(found_in(recorded) == Ids{"camera.focal"});
  }
  SECTION("a focal length of both cameras 3 % too long") {
    scale_focal(rig, 1.03);
    CHECK(found_in(recorded) == Ids{"camera.focal"});
  }
  SECTION("a focal length of the right one 3 % too long") {
    rig.cameras[1].fx *= 1.03;
    rig.cameras[1].fy *= 1.03;
    CHECK(found_in(recorded) == Ids{"stereo.focal"});
  }
  SECTION("millimetres instead of metres") {
    for (Camera& camera : rig.cameras) camera.T_body_cam.translation() *= 1000.0;
    CHECK(found_in(recorded) == Ids{"stereo.baseline"});
  }
}

TEST_CASE("A fault in the samples of MH_01 is the only finding", "[diagnosis]") {
  if (!machine_hall()) return;
  Recorded recorded = *machine_hall();
  SensorSample& sample = recorded.sample;
  SECTION("degrees instead of radians") {
    rotate_gyro(sample, [](Eigen::Vector3d& gyro) { gyro *= kDegrees; });
    CHECK(found_in(recorded) == Ids{"imu.gyro_in_degrees"});
  }
  SECTION("a gyroscope with one axis inverted") {
    rotate_gyro(sample, [](Eigen::Vector3d& gyro) { gyro.y() *= -1.0; });
    CHECK(found_in(recorded) == Ids{"imu.mirrored"});
  }
  SECTION("g instead of m/s^2") {
    for (ImuSample& measured : sample.imu) measured.accel /= 9.80665;
    CHECK(found_in(recorded) == Ids{"imu.accel_in_g"});
  }
  SECTION("stamps 20 ms late") {
    for (ImuSample& measured : sample.imu) measured.stamp += 20'000'000;
    CHECK(found_in(recorded) == Ids{"imu.time_offset"});
  }
  SECTION("stamps 20 ms early") {
    for (ImuSample& measured : sample.imu) measured.stamp -= 20'000'000;
    CHECK(found_in(recorded) == Ids{"imu.time_offset"});
  }
  SECTION("the sensor of another robot") {
    for (std::size_t k = 0; k < sample.imu.size() / 2; ++k)
      std::swap(sample.imu[k].gyro, sample.imu[sample.imu.size() - 1 - k].gyro);
    CHECK(found_in(recorded) == Ids{"imu.unrelated"});
  }
  SECTION("swapped cameras") {
    for (StereoMatches& image : sample.stereo)
      for (PixelPair& pair : image.pairs) std::swap(pair.a, pair.b);
    CHECK(found_in(recorded) == Ids{"stereo.swapped"});
  }
}

TEST_CASE("V1_01 at rest gives no findings and no figures that need motion", "[diagnosis]") {
  const auto data = shared_data("euroc/V1_01_easy");
  if (!data) return;
  const TemporaryFolder folder;
  link_v1(
      *data, folder.path(),
      [&](int camera) { return *data / "static_start" / ("cam" + std::to_string(camera)); },
      [](int, const std::string& file) { return file.ends_with(".jpg"); });
  const Recorded recorded = read(folder.path(), 10.0);
  CHECK(found_in(recorded) == Ids{"frames.rate"});  // 5 Hz: every fourth image
  const Examination inertial = examine_inertial(recorded.sample, recorded.rig.stereo);
  CHECK_THAT(to_text(inertial.figures), Catch::Contains("not determined: the camera turns by"));
}

TEST_CASE("V1_01 in flight with images a second apart gives findings only on rate and gaps",
          "[diagnosis]") {
  const auto data = shared_data("euroc/V1_01_easy");
  if (!data) return;
  const TemporaryFolder folder;
  link_v1(
      *data, folder.path(), [&](int) { return *data / "keyframes"; },
      [](int camera, const std::string& file) {
        return file.ends_with('_' + std::to_string(camera) + ".jpg");
      });
  const Recorded recorded = read(folder.path(), 60.0);
  CHECK(found_in(recorded) == Ids{"frames.rate", "frames.gap"});
}

TEST_CASE("The world of the demo gives no findings and an inserted fault is the only one",
          "[diagnosis][demo_world]") {
  if (!fs::exists(kDemoWorld)) {
    std::cout << "SKIPPED: the test of the demo has not rendered its world\n";
    return;
  }
  const Recorded sound = read(kDemoWorld / "robot0", 8.0);
  CHECK(found_in(sound).empty());
  for (const double factor : {0.97, 1.03}) {
    Recorded other_lens = sound;
    scale_focal(other_lens.rig.stereo, factor);
    CHECK(found_in(other_lens) == Ids{"camera.focal"});
  }
  Recorded late = sound;
  for (ImuSample& measured : late.sample.imu) measured.stamp += 20'000'000;
  CHECK(found_in(late) == Ids{"imu.time_offset"});
  Recorded in_degrees = sound;
  rotate_gyro(in_degrees.sample, [](Eigen::Vector3d& gyro) { gyro *= kDegrees; });
  CHECK(found_in(in_degrees) == Ids{"imu.gyro_in_degrees"});
  Recorded swapped = sound;
  for (StereoMatches& image : swapped.sample.stereo)
    for (PixelPair& pair : image.pairs) std::swap(pair.a, pair.b);
  CHECK(found_in(swapped) == Ids{"stereo.swapped"});
  Recorded inverted = sound;
  inverted.rig.stereo = undone(sound.rig.stereo, StereoFault::kInvertedCameras);
  CHECK(found_in(inverted) == Ids{"stereo.inverted_cameras", "extrinsics.inverted"});
}

}  // namespace km
