#include "modules/diagnosis/examine_sensors.hpp"
#include "modules/diagnosis/stereo_fit.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "test/support/demo_world.hpp"
#include "test/support/euroc_copy.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Data of a recording and its calibration; faults are inserted in either.
struct Recorded {
  SensorSample sample;
  SensorRig rig;
  ReaderReport report;
};

Recorded read(const fs::path& folder, double to_s) {
  FolderReader reader = open_folder(folder, {.part = {.to_s = to_s}});
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

void swap_images(SensorSample& sample) {
  for (StereoMatches& image : sample.stereo)
    for (PixelPair& pair : image.pairs) std::swap(pair.a, pair.b);
}

}  // namespace

TEST_CASE("MH_01 gives no findings, and an inserted fault is the only one") {
  if (!machine_hall()) return;
  struct Case {
    Ids ids;
    std::function<void(StereoRig&, SensorSample&)> insert;
  };
  const auto invert = [](StereoFault fault) {
    return [fault](StereoRig& rig, auto&) { rig = undone(rig, fault); };
  };
  const auto rotate_both = [](const std::function<Eigen::Matrix3d(const Eigen::Matrix3d&)>& turn) {
    return [turn](StereoRig& rig, auto&) {
      const SE3 T_left_right = rig.T_left_right();
      rig.cameras[0].T_body_cam.linear() = turn(rig.cameras[0].T_body_cam.linear());
      rig.cameras[1].T_body_cam = rig.cameras[0].T_body_cam * T_left_right;
    };
  };
  const auto stretch = [](double factor) {  // the baseline alone
    return [factor](StereoRig& rig, auto&) {
      SE3 T_left_right = rig.T_left_right();
      T_left_right.translation() *= factor;
      rig.cameras[1].T_body_cam = rig.cameras[0].T_body_cam * T_left_right;
    };
  };
  const auto scale_mode = [](double ratio) {
    return [ratio](StereoRig& rig, auto&) {
      for (Camera& camera : rig.cameras)
        camera.fx *= ratio, camera.fy *= ratio, camera.cx *= ratio, camera.cy *= ratio;
    };
  };
  const auto change_gyro = [](const std::function<void(Eigen::Vector3d&)>& change) {
    return [change](auto&, SensorSample& sample) { rotate_gyro(sample, change); };
  };
  const auto move_stamps = [](Stamp by) {
    return [by](auto&, SensorSample& sample) {
      for (ImuSample& measured : sample.imu) measured.stamp += by;
    };
  };
  const Case c = GENERATE_COPY(
      Case{{}, [](auto&, auto&) {}}, Case{{"stereo.inverted"}, invert(StereoFault::kInvertedPair)},
      Case{{"stereo.inverted_cameras", "extrinsics.inverted"},
           invert(StereoFault::kInvertedCameras)},
      Case{{"stereo.inverted_right"}, invert(StereoFault::kInvertedRight)},
      Case{{"extrinsics.inverted"},
           rotate_both([](const Eigen::Matrix3d& R) { return Eigen::Matrix3d(R.transpose()); })},
      Case{{"extrinsics.rotation"}, rotate_both([](const Eigen::Matrix3d& R) {
             const Eigen::Vector3d axis = Eigen::Vector3d(1.0, 1.0, 0.0).normalized();
             return Eigen::Matrix3d(Eigen::AngleAxisd(3.0 / kDegrees, axis) * R);
           })},
      Case{{"camera.focal"}, [](auto& rig, auto&) { scale_focal(rig, 0.97); }},
      Case{{"camera.focal"}, [](auto& rig, auto&) { scale_focal(rig, 1.03); }},
      Case{{"stereo.focal"},
           [](auto& rig, auto&) { rig.cameras[1].fx *= 1.03, rig.cameras[1].fy *= 1.03; }},
      Case{{"stereo.baseline", "extrinsics.lever"},
           [](auto& rig, auto&) {
             for (Camera& camera : rig.cameras) camera.T_body_cam.translation() *= 1000.0;
           }},
      Case{{"depth.scale"}, stretch(4.0)}, Case{{"stereo.baseline"}, stretch(100.0)},
      Case{{"stereo.baseline"}, stretch(1000.0)},
      Case{{"imu.exchanged"},
           [](auto&, auto& sample) {
             for (ImuSample& measured : sample.imu) std::swap(measured.gyro, measured.accel);
           }},
      Case{{"stereo.epipolar"},
           [](auto& rig, auto&) {
             for (Camera& camera : rig.cameras)
               camera.lens = Lens(LensModel::kRadialTangential, {-2.9, 40.0, 0.0, 0.0});
           }},
      Case{{"imu.accel_negated"},
           [](auto&, auto& sample) {
             for (ImuSample& measured : sample.imu) measured.accel *= -1.0;
           }},
      Case{{"stereo.other_mode"}, scale_mode(0.5)}, Case{{"stereo.other_mode"}, scale_mode(2.0)},
      Case{{"imu.gyro_in_degrees"}, change_gyro([](auto& gyro) { gyro *= kDegrees; })},
      Case{{"imu.mirrored"}, change_gyro([](auto& gyro) { gyro.y() *= -1.0; })},
      Case{{"imu.accel_in_g"},
           [](auto&, auto& sample) {
             for (ImuSample& measured : sample.imu) measured.accel /= 9.80665;
           }},
      Case{{"imu.time_offset"}, move_stamps(20'000'000)},
      Case{{"imu.time_offset"}, move_stamps(-20'000'000)},
      Case{{"imu.unrelated"},  // the sensor of another robot
           [](auto&, auto& sample) {
             for (std::size_t k = 0; k < sample.imu.size() / 2; ++k)
               std::swap(sample.imu[k].gyro, sample.imu[sample.imu.size() - 1 - k].gyro);
           }},
      Case{{"stereo.swapped"}, [](auto&, auto& sample) { swap_images(sample); }});
  Recorded recorded = *machine_hall();
  c.insert(recorded.rig.stereo, recorded.sample);
  CHECK(found_in(recorded) == c.ids);
}

TEST_CASE("A pair that is turned a little is not one of another mode") {
  if (!machine_hall()) return;
  StereoRig rig = machine_hall()->rig.stereo;
  rig.cameras[1].T_body_cam.linear() *=
      Eigen::AngleAxisd(0.2 / kDegrees, Eigen::Vector3d::UnitX()).toRotationMatrix();
  CHECK(best_alternative(machine_hall()->sample.stereo, rig).fault != StereoFault::kOtherMode);
}

TEST_CASE("V1_01 at rest gives no findings and no figures that need motion") {
  const auto data = shared_data("euroc/V1_01_easy");
  if (!data) return;
  const TemporaryFolder folder;
  link_static_start(*data, folder.path());
  const Recorded recorded = read(folder.path(), 10.0);
  CHECK(found_in(recorded) == Ids{"frames.rate"});  // 5 Hz: every fourth image
  const Examination inertial = examine_inertial(recorded.sample, recorded.rig.stereo);
  CHECK_THAT(to_text(inertial.figures), Contains("not determined: the camera turns by"));
}

TEST_CASE("The world of the demo gives no findings and an inserted fault is the only one",
          "[demo_world]") {
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
  swap_images(swapped.sample);
  CHECK(found_in(swapped) == Ids{"stereo.swapped"});
  Recorded inverted = sound;
  inverted.rig.stereo = undone(sound.rig.stereo, StereoFault::kInvertedCameras);
  CHECK(found_in(inverted) == Ids{"stereo.inverted_cameras", "extrinsics.inverted"});
}

}  // namespace km
