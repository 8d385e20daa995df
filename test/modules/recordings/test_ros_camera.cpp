#include <catch2/catch.hpp>

#include <stdexcept>

#include "modules/core/lie.hpp"
#include "modules/recordings/ros_camera.hpp"

namespace km {
namespace {

RosCameraInfo some_info() {
  RosCameraInfo info;
  info.header.frame_id = "left_optical";
  info.width = 640;
  info.height = 480;
  info.distortion_model = "plumb_bob";
  info.d = {-0.28, 0.07, 2e-4, 1e-5, 0.0};
  info.k = {458.0, 0, 320.5, 0, 457.0, 240.5, 0, 0, 1};
  info.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.p = {430.0, 0, 318.0, 0, 0, 430.0, 239.0, 0, 0, 0, 1, 0};
  return info;
}

// The other half of a pair with a baseline of 0.1 m.
RosCameraInfo right_of(RosCameraInfo left) {
  left.header.frame_id = "right_optical";
  left.p[3] = -43.0;
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
  info.d = {-0.28, 0.07, 2e-4, 1e-5, 0.03};
  CHECK(lens() == Lens(LensModel::kRadialTangential, info.d));
  info.d = {0, 0, 0, 0, 0};  // as of rectified images
  CHECK(lens().is_ideal());
  info.distortion_model = "rational_polynomial";
  info.d = {0.4, 0.1, 1e-4, 2e-4, 0.01, 0.8, 0.3, 0.04};
  CHECK(lens() == Lens(LensModel::kRadialTangential, info.d));
  info.d.resize(12, 0.0);
  CHECK(lens().coefficients().size() == 8);
  for (const char* name : {"equidistant", "fisheye"}) {
    info.distortion_model = name;
    info.d = {0.003, 7e-4, -2e-3, 2e-4};
    CHECK(lens() == Lens(LensModel::kEquidistant, info.d));
  }
  info.distortion_model = "";
  info.d = {};
  CHECK(lens().is_ideal());
}

TEST_CASE("The baseline is computed from P of the right camera", "[recordings]") {
  CHECK(baseline_m(right_of(some_info())).value() == Approx(0.1));
  CHECK(!baseline_m(some_info()));
  RosCameraInfo info = right_of(some_info());
  info.p[3] = 43.0;  // a camera to the left
  CHECK(!baseline_m(info));
  info.p.fill(0.0);
  CHECK(!baseline_m(info));
}

TEST_CASE("The frame of a CameraInfo is the rectified camera's", "[recordings]") {
  RosCameraInfo info = some_info();
  const Eigen::Matrix3d R = so3_exp({0.01, -0.03, 0.02});
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(info.r.data()) = R;
  // By the message's documentation R takes what the camera sees to the rectified camera.
  const Eigen::Vector3d p_raw(0.4, -0.3, 2.0);
  CHECK((T_frame_camera(info, RosImages::kRaw) * p_raw).isApprox(R * p_raw, 1e-12));
  CHECK(T_frame_camera(info, RosImages::kRectified).isApprox(SE3::Identity()));
  info.r.fill(0.0);
  CHECK(T_frame_camera(info, RosImages::kRaw).isApprox(SE3::Identity()));
  info.r[0] = 2.0;
  CHECK_THROWS_WITH(T_frame_camera(info, RosImages::kRaw),
                    Catch::Contains("frame 'left_optical': R is not a rotation"));
}

TEST_CASE("A CameraInfo that is no calibration is refused by frame and field", "[recordings]") {
  struct Case {
    const char* why;
    void (*spoil)(RosCameraInfo&);
  };
  const Case c = GENERATE(
      Case{"K is 0: the camera is not calibrated", [](auto& info) { info.k.fill(0.0); }},
      Case{"width and height: sides are whole numbers", [](auto& info) { info.width = 0; }},
      Case{"K: a focal length of -457 px", [](auto& info) { info.k[4] = -457.0; }},
      Case{"K: a skew of 0.5", [](auto& info) { info.k[1] = 0.5; }},
      Case{"distortion_model 'thin_prism' is not supported, only plumb_bob",
           [](auto& info) { info.distortion_model = "thin_prism"; }},
      Case{"distortion_model '' is not supported", [](auto& info) { info.distortion_model = ""; }},
      Case{"D has 12 coefficients; of rational_polynomial only 8 are supported",
           [](auto& info) {
             info.distortion_model = "rational_polynomial";
             info.d = {0, 0, 0, 0, 0, 0, 0, 0, 1e-3, 0, 0, 0};
           }},
      Case{"binning_x 0, binning_y 2: binned images are not supported",
           [](auto& info) { info.binning_y = 2; }},
      Case{"roi: images of a part of the camera are not supported",
           [](auto& info) {
             info.roi.x_offset = 8;
             info.roi.height = 480;
             info.roi.width = 632;
           }},
      Case{"D: nan is outside", [](auto& info) { info.d[0] = std::nan(""); }});
  CAPTURE(c.why);
  RosCameraInfo info = some_info();
  c.spoil(info);
  CHECK_THROWS_WITH(camera_of(info, RosImages::kRaw),
                    Catch::Contains("frame 'left_optical': ") && Catch::Contains(c.why));
}

}  // namespace
}  // namespace km
