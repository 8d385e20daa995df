#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/camera_calibration.hpp"
#include "modules/core/camera/image_size.hpp"
#include "modules/core/geometry/lie.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

Camera euroc_left() {
  return {.width = 752,
          .height = 480,
          .fx = 458.654,
          .fy = 457.296,
          .cx = 367.215,
          .cy = 248.375,
          .lens = Lens(LensModel::kRadialTangential,
                       {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05})};
}

TEST_CASE("Unprojecting inverts projecting over the whole image") {
  const Camera camera = euroc_left();
  for (double u = 0; u <= 752; u += 47)
    for (double v = 0; v <= 480; v += 48) {
      const auto bearing = camera.unproject({u, v});
      REQUIRE(bearing.has_value());
      CHECK((camera.project(*bearing).value() - Eigen::Vector2d(u, v)).norm() < 1e-8);
    }
}

TEST_CASE("A pixel without a bearing has none") {
  CHECK_FALSE(euroc_left().unproject({1e6, 1e6}).has_value());
  CHECK_FALSE(euroc_left().unproject({std::nan(""), 100.0}).has_value());
}

TEST_CASE("A ray that does not point forward has no pixel") {
  const Camera camera = euroc_left();
  CHECK(camera.project_ray({0.2, -0.1, 2.0}) == camera.project({0.1, -0.05}));
  CHECK_FALSE(camera.project_ray({0.1, -0.05, 0.0}).has_value());
  CHECK_FALSE(camera.project_ray({0.1, -0.05, -1.0}).has_value());
}

CameraCalibration some_calibration(std::mt19937& rng) {
  CameraCalibration calibration{.offset_s = 0.03 * random_vector<1>(rng)(0),
                                .T_body_rig = retract(SE3::Identity(), 0.3 * random_vector<6>(rng)),
                                .readout_s = 0.01 * random_vector<1>(rng)(0)};
  return calibration;
}

TEST_CASE("local_coordinates_to() is the inverse of retracted()") {
  std::mt19937 rng(1);
  const CameraCalibration calibration = some_calibration(rng);
  const CalibrationVector delta = 0.1 * random_vector<kCalibrationSize>(rng);
  CHECK((calibration.local_coordinates_to(calibration.retracted(delta)) - delta).norm() < 1e-12);
  CHECK(calibration.local_coordinates_to(calibration).norm() < 1e-12);
}

TEST_CASE("A calibration on top of a correction moves cameras like both in turn") {
  std::mt19937 rng(2);
  const CameraCalibration correction = some_calibration(rng), found = some_calibration(rng);
  StereoRig in_turn, at_once;
  for (std::size_t c = 0; c < 2; ++c)
    in_turn.cameras[c].T_body_cam = at_once.cameras[c].T_body_cam = random_pose(rng);
  correction.apply_to(in_turn);
  found.apply_to(in_turn);
  const CameraCalibration both = found.composed_with(correction);
  both.apply_to(at_once);
  for (std::size_t c = 0; c < 2; ++c)
    CHECK(in_turn.cameras[c].T_body_cam.isApprox(at_once.cameras[c].T_body_cam));
  CHECK(both.offset_s == Approx(found.offset_s + correction.offset_s));
  CHECK(both.readout_s == Approx(found.readout_s + correction.readout_s));
  CHECK(found.local_coordinates_to(both.without(correction)).norm() < 1e-12);
  // Both have the same covariance.
  const CalibrationVector delta = 0.1 * random_vector<kCalibrationSize>(rng);
  CHECK(
      (both.local_coordinates_to(found.retracted(delta).composed_with(correction)) - delta).norm() <
      1e-12);
}

TEST_CASE("PNG and JPEG files contain their size") {
  const std::string png("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\2\xF0\0\0\1\xE0", 24);
  CHECK(stated_image_size(png) == ImageSize{752, 480});
  CHECK_FALSE(stated_image_size(png.substr(0, 23)));
  // A comment of two bytes, a fill byte, then the frame header of a progressive file.
  const std::string jpeg("\xFF\xD8\xFF\xFE\0\4ab\xFF\xFF\xC2\0\x11\x08\1\xE0\2\xF0\3", 19);
  CHECK(stated_image_size(jpeg) == ImageSize{752, 480});
  CHECK_FALSE(stated_image_size(jpeg.substr(0, 16)));
}

TEST_CASE("A file without a size in its header has no size") {
  CHECK_FALSE(stated_image_size(""));
  CHECK_FALSE(stated_image_size("BM"));
  CHECK_FALSE(stated_image_size("\xFF\xD8"));
}

}  // namespace
}  // namespace km
