#include <catch2/catch.hpp>

#include <stdexcept>

#include "modules/core/lie.hpp"
#include "modules/recordings/ros_camera.hpp"

namespace km {
namespace {

RosCameraInfo some_info() {
  RosCameraInfo info;
  info.header.frame = "left_optical";
  info.width = 640;
  info.height = 480;
  info.distortion_model = "plumb_bob";
  info.D = {-0.28, 0.07, 2e-4, 1e-5, 0.0};
  info.K = {458.0, 0, 320.5, 0, 457.0, 240.5, 0, 0, 1};
  info.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.P = {430.0, 0, 318.0, 0, 0, 430.0, 239.0, 0, 0, 0, 1, 0};
  return info;
}

// The other half of a pair with a baseline of 0.1 m.
RosCameraInfo right_of(RosCameraInfo left) {
  left.header.frame = "right_optical";
  left.P[3] = -43.0;
  return left;
}

TEST_CASE("A raw image's camera is that of K and D", "[recordings]") {
  const Camera camera = camera_of(some_info(), RosImages::kRaw);
  CHECK(camera.width == 640);
  CHECK(camera.height == 480);
  CHECK(camera.fx == 458.0);
  CHECK(camera.fy == 457.0);
  CHECK(camera.cx == 320.5);
  CHECK(camera.cy == 240.5);
  CHECK(camera.lens == Lens(LensModel::kRadialTangential, {-0.28, 0.07, 2e-4, 1e-5}));
}

TEST_CASE("A rectified image's camera is that of P", "[recordings]") {
  const Camera camera = camera_of(some_info(), RosImages::kRectified);
  CHECK(camera.fx == 430.0);
  CHECK(camera.cx == 318.0);
  CHECK(camera.cy == 239.0);
  CHECK(camera.lens.is_ideal());
}

TEST_CASE("ROS's models of distortion are lenses", "[recordings]") {
  RosCameraInfo info = some_info();
  const auto lens = [&] { return camera_of(info, RosImages::kRaw).lens; };
  info.D = {-0.28, 0.07, 2e-4, 1e-5, 0.03};
  CHECK(lens() == Lens(LensModel::kRadialTangential, info.D));
  info.D = {0, 0, 0, 0, 0};  // as of rectified images
  CHECK(lens().is_ideal());
  info.distortion_model = "rational_polynomial";
  info.D = {0.4, 0.1, 1e-4, 2e-4, 0.01, 0.8, 0.3, 0.04};
  CHECK(lens() == Lens(LensModel::kRadialTangential, info.D));
  info.D.resize(12, 0.0);
  CHECK(lens().coefficients().size() == 8);
  for (const char* name : {"equidistant", "fisheye"}) {
    info.distortion_model = name;
    info.D = {0.003, 7e-4, -2e-3, 2e-4};
    CHECK(lens() == Lens(LensModel::kEquidistant, info.D));
  }
  info.distortion_model = "";
  info.D = {};
  CHECK(lens().is_ideal());
}

TEST_CASE("A rectified pair has the baseline of the right camera's P", "[recordings]") {
  SE3 T_body_left = SE3::Identity();
  T_body_left.translation() = Eigen::Vector3d(0.1, 0.2, 0.3);
  const StereoRig rig =
      stereo_of(some_info(), right_of(some_info()), RosImages::kRectified, T_body_left);
  CHECK(rig.cameras[0].T_body_cam.isApprox(T_body_left));
  CHECK(rig.T_left_right().translation().isApprox(Eigen::Vector3d(0.1, 0, 0)));
  CHECK(rig.T_left_right().linear().isIdentity());
  CHECK(rig.cameras[1].lens.is_ideal());
}

TEST_CASE("A raw pair stands as its rectifying rotations say", "[recordings]") {
  RosCameraInfo left = some_info(), right = right_of(some_info());
  const Eigen::Matrix3d R_left = so3_exp({0.01, -0.03, 0.02}), R_right = so3_exp({-0.02, 0.01, 0});
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  Eigen::Map<RowMajor>(left.R.data()) = R_left;
  Eigen::Map<RowMajor>(right.R.data()) = R_right;
  const StereoRig rig = stereo_of(left, right, RosImages::kRaw, SE3::Identity());
  // A point in the rectified left camera, and where each raw camera has it.
  const Eigen::Vector3d p(0.4, -0.3, 2.0);
  const Eigen::Vector3d in_left = R_left.transpose() * p;
  const Eigen::Vector3d in_right = R_right.transpose() * (p - Eigen::Vector3d(0.1, 0, 0));
  CHECK((rig.T_left_right() * in_right).isApprox(in_left, 1e-12));
}

TEST_CASE("A CameraInfo that is no calibration is refused by frame and field", "[recordings]") {
  RosCameraInfo info = some_info();
  const auto refuses = [&](const char* why) {
    CHECK_THROWS_WITH(camera_of(info, RosImages::kRaw),
                      Catch::Contains("frame 'left_optical': ") && Catch::Contains(why));
  };
  SECTION("uncalibrated") {
    info.K.fill(0.0);
    refuses("K is 0: the camera is not calibrated");
  }
  SECTION("no size") {
    info.width = 0;
    refuses("width and height: sides are whole numbers");
  }
  SECTION("focal length") {
    info.K[4] = -457.0;
    refuses("K: a focal length of -457 px");
  }
  SECTION("skew") {
    info.K[1] = 0.5;
    refuses("K: a skew of 0.5");
  }
  SECTION("unknown model") {
    info.distortion_model = "thin_prism";
    refuses("distortion_model 'thin_prism' is not supported, only plumb_bob");
  }
  SECTION("distortion without a model") {
    info.distortion_model = "";
    refuses("distortion_model '' is not supported");
  }
  SECTION("thin prism") {
    info.distortion_model = "rational_polynomial";
    info.D = {0, 0, 0, 0, 0, 0, 0, 0, 1e-3, 0, 0, 0};
    refuses("D has 12 coefficients; of rational_polynomial only 8 are supported");
  }
  SECTION("not finite") {
    info.D[0] = std::nan("");
    refuses("D: nan is outside");
  }
}

TEST_CASE("A pair without baseline or rotation is refused", "[recordings]") {
  const RosCameraInfo left = some_info();
  const auto refuses = [&](const RosCameraInfo& right, const char* why) {
    CHECK_THROWS_WITH(stereo_of(left, right, RosImages::kRaw, SE3::Identity()),
                      Catch::Contains("frame 'right_optical': ") && Catch::Contains(why));
  };
  RosCameraInfo right = right_of(left);
  right.P[3] = 0.0;
  refuses(right, "P[3] = 0: Tx = -fx * baseline of a right camera is negative");
  right.P[3] = 43.0;
  refuses(right, "P[3] = 43");
  right = right_of(left);
  right.R.fill(0.0);
  refuses(right, "R is not a rotation");
  right = right_of(left);
  right.P.fill(0.0);
  refuses(right, "P has no focal length");
}

}  // namespace
}  // namespace km
