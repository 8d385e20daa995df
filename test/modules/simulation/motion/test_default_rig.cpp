#include <catch2/catch.hpp>

#include <stdexcept>

#include "modules/core/lie.hpp"
#include "modules/simulation/motion/default_rig.hpp"

namespace km {
namespace {

TEST_CASE("The flying rig at 752x480 is EuRoC's as published", "[motion]") {
  const SensorRig rig = default_rig(RigKind::kFlying, 752, 480);
  const PinholeCamera& left = rig.stereo.cameras[0];
  CHECK(left.fx == Approx(458.654));
  CHECK(left.fy == Approx(457.296));
  CHECK(left.cx == Approx(367.215));
  CHECK(left.cy == Approx(248.375));
  CHECK(left.distortion[0] == -0.28340811);
  CHECK(rig.stereo.cameras[1].cx == Approx(379.999));
  CHECK(rig.stereo.baseline_m() == Approx(0.110).margin(0.0005));
  CHECK(rig.imu.gyro_noise_density == 1.6968e-04);
  CHECK(rig.imu.rate_hz == 200.0);
  for (const PinholeCamera& camera : rig.stereo.cameras) {
    const Eigen::Matrix3d R = camera.T_body_cam.linear();
    CHECK((R * R.transpose()).isIdentity(1e-12));
    CHECK(R.determinant() == Approx(1.0));
  }
}

TEST_CASE("At another resolution a bearing falls on the same part of the image", "[motion]") {
  const RigKind kind = GENERATE(RigKind::kFlying, RigKind::kVehicle);
  const PinholeCamera full = default_rig(kind, 752, 480).stereo.cameras[0];
  const PinholeCamera half = default_rig(kind, 376, 240).stereo.cameras[0];
  CHECK(half.width == 376);
  CHECK(half.height == 240);
  for (const Eigen::Vector2d& bearing :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(0.5, -0.3), Eigen::Vector2d(-0.6, 0.4)}) {
    // The edge of the image is at -0.5 px at either resolution.
    const Eigen::Vector2d at_full = full.project(bearing), at_half = half.project(bearing);
    CHECK((at_full.x() + 0.5) / 2.0 - 0.5 == Approx(at_half.x()).margin(1e-9));
    CHECK((at_full.y() + 0.5) / 2.0 - 0.5 == Approx(at_half.y()).margin(1e-9));
  }
  // Another aspect: cut around the centre.
  const PinholeCamera flat = default_rig(kind, 752, 400).stereo.cameras[0];
  CHECK(flat.fx == Approx(full.fx));
  CHECK(flat.cx == Approx(full.cx));
  CHECK(flat.cy == Approx(full.cy - 40.0));
}

TEST_CASE("Both rigs look forward, left of the vehicle on the left", "[motion]") {
  const RigKind kind = GENERATE(RigKind::kFlying, RigKind::kVehicle);
  const Eigen::Matrix3d R_vehicle_body = vehicle_from_body(kind);
  CHECK((R_vehicle_body * R_vehicle_body.transpose()).isIdentity(1e-12));
  CHECK(R_vehicle_body.determinant() == Approx(1.0));
  const SensorRig rig = default_rig(kind, 752, 480);
  Eigen::Matrix3d R_vehicle_cam;  // z forward, x right, y down
  R_vehicle_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  for (const PinholeCamera& camera : rig.stereo.cameras) {
    const Eigen::Matrix3d R = R_vehicle_body * camera.T_body_cam.linear();
    CHECK(angle_of(R_vehicle_cam.transpose() * R) < 0.05);  // mounted to 3 degrees
  }
  const Eigen::Vector3d to_right = rig.stereo.T_left_right().translation();
  CHECK(to_right.x() == Approx(rig.stereo.baseline_m()).epsilon(0.01));
}

TEST_CASE("The vehicle's rig has a street's baseline", "[motion]") {
  const SensorRig rig = default_rig(RigKind::kVehicle, 752, 480);
  CHECK(rig.stereo.baseline_m() == Approx(0.27));
  const DepthSensorOptions depth = depth_options(rig);
  CHECK(depth.baseline_m == Approx(0.27));
  CHECK(depth.focal_px == Approx(458.654));
  SensorRig ranged = rig;
  ranged.depth = DepthRange{0.5, 12.0};
  CHECK(depth_options(ranged).min_range_m == 0.5);
  CHECK(depth_options(ranged).max_range_m == 12.0);
}

TEST_CASE("A rig refuses resolutions without sense", "[motion]") {
  CHECK_THROWS_AS(default_rig(RigKind::kFlying, 0, 480), std::invalid_argument);
  CHECK_THROWS_AS(default_rig(RigKind::kVehicle, 752, -1), std::invalid_argument);
  CHECK_THROWS_AS(default_rig(RigKind::kVehicle, 100000, 480), std::invalid_argument);
}

}  // namespace
}  // namespace km
