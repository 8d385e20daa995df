#include "modules/sensors/node/euroc_rig.hpp"

#include <catch2/catch.hpp>

#include "modules/core/lie.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "test/modules/sensors/euroc_folder.hpp"

namespace km {

TEST_CASE("The rig has the numbers of the sensor files", "[sensors]") {
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

TEST_CASE("The body frame is the inertial sensor's", "[sensors]") {
  const EurocFolder folder;
  folder.replace("imu0/sensor.yaml", "1, 0, 0, 0, 0, 1", "1, 0, 0, 0.5, 0, 1");
  const SensorRig rig = read_euroc_rig(folder.mav0());
  CHECK(rig.stereo.cameras[0].T_body_cam.translation().isApprox(Eigen::Vector3d(-0.5, 0.2, 0.3)));
  CHECK(rig.stereo.baseline_m() == Approx(0.1));
}

TEST_CASE("OpenCV's first line is accepted", "[sensors]") {
  const EurocFolder folder;
  folder.write("cam0/sensor.yaml", "%YAML:1.0\n" + EurocFolder::camera_yaml(0.0));
  CHECK(read_euroc_rig(folder.mav0()).stereo.cameras[0].fx == 30.0);
}

TEST_CASE("A rotation with rounded digits is made exact", "[sensors]") {
  const EurocFolder folder;
  folder.replace("cam0/sensor.yaml", "0, -1, 0,", "0, -1.00003, 0,");
  const Eigen::Matrix3d R = read_euroc_rig(folder.mav0()).stereo.cameras[0].T_body_cam.linear();
  CHECK((R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-14);
}

TEST_CASE("An impossible calibration is refused with file and line", "[sensors]") {
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
      Case{"cam1", "pinhole", "eucm",
           "line 10: camera_model 'eucm' is not supported, only pinhole, omni and ds"},
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
                    Catch::Contains(c.sensor + "/sensor.yaml") && Catch::Contains(c.message));
}

TEST_CASE("Two cameras in one place are refused", "[sensors]") {
  const EurocFolder folder;
  folder.write("cam1/sensor.yaml", EurocFolder::camera_yaml(0.0));
  CHECK_THROWS_WITH(read_euroc_rig(folder.mav0()), Catch::Contains("where the left one is"));
}

}  // namespace km
