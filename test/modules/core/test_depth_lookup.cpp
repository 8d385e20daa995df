#include "modules/core/camera/depth_lookup.hpp"

#include "test/support/test.hpp"

namespace km {
namespace {

Camera small_camera() {
  return {.width = 64, .height = 48, .fx = 50.0, .fy = 50.0, .cx = 31.5, .cy = 23.5};
}

// Depth of the plane normal . p = distance.
DepthImage plane_depth(const Camera& camera, const Eigen::Vector3d& normal, double distance_m) {
  DepthImage image{camera.width, camera.height, {}};
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector2d bearing = *camera.unproject(Eigen::Vector2d(x, y));
      const double z_m = distance_m / normal.dot(bearing.homogeneous());
      image.millimetres.push_back(static_cast<std::uint16_t>(std::lround(1e3 * z_m)));
    }
  return image;
}

constexpr double kNoEdge = 1e9;

TEST_CASE("The depth of a slanted plane is exact between pixels") {
  const Camera camera = small_camera();
  const Eigen::Vector3d normal(0.3, -0.5, 0.9);
  const double distance_m = 4.0;
  const DepthImage image = plane_depth(camera, normal, distance_m);
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> u(0.0, 63.0), v(0.0, 47.0);
  for (int i = 0; i < 200; ++i) {
    const double x = u(rng);
    const Eigen::Vector2d px(x, v(rng));
    CAPTURE(px.transpose());
    const auto inverse_depth = inverse_depth_at(image, px, kNoEdge);
    REQUIRE(inverse_depth.has_value());
    const double expected = normal.dot(camera.unproject(px)->homogeneous()) / distance_m;
    // Half a millimetre of rounding, at z = 1 / expected.
    CHECK(std::abs(*inverse_depth - expected) <= 0.51e-3 * expected * expected);
  }
}

TEST_CASE("Pixels without a depth do not affect their neighbours") {
  DepthImage image = plane_depth(small_camera(), Eigen::Vector3d::UnitZ(), 2.0);
  image.millimetres[10 * 64 + 20] = 0;
  CHECK_FALSE(inverse_depth_at(image, {20.0, 10.0}, kNoEdge).has_value());
  CHECK_FALSE(inverse_depth_at(image, {20.4, 10.4}, kNoEdge).has_value());
  CHECK(inverse_depth_at(image, {20.6, 10.4}, kNoEdge).value() == Approx(0.5));
}

TEST_CASE("There is depth on either side of an edge but not across it") {
  DepthImage image = plane_depth(small_camera(), Eigen::Vector3d::UnitZ(), 2.0);
  for (std::size_t y = 0; y < 48; ++y)
    for (std::size_t x = 32; x < 64; ++x) image.millimetres[y * 64 + x] = 4000;
  const double spread = 0.1;  // the edge is 0.25
  CHECK(inverse_depth_at(image, {31.0, 20.5}, spread).value() == Approx(0.5));
  CHECK(inverse_depth_at(image, {32.0, 20.5}, spread).value() == Approx(0.25));
  CHECK_FALSE(inverse_depth_at(image, {31.5, 20.5}, spread).has_value());
  CHECK(inverse_depth_at(image, {31.5, 20.5}, 0.3).value() == Approx(0.375));
}

TEST_CASE("Outside the image there is no depth") {
  const DepthImage image = plane_depth(small_camera(), Eigen::Vector3d::UnitZ(), 2.0);
  CHECK(inverse_depth_at(image, {63.0, 47.0}, kNoEdge).has_value());
  CHECK(inverse_depth_at(image, {0.0, 0.0}, kNoEdge).has_value());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Eigen::Vector2d& px : {Eigen::Vector2d(-0.01, 5.0), Eigen::Vector2d(5.0, 47.01),
                                    Eigen::Vector2d(1e300, 5.0), Eigen::Vector2d(5.0, nan)})
    CHECK_FALSE(inverse_depth_at(image, px, kNoEdge).has_value());
  CHECK_FALSE(inverse_depth_at({}, {0.0, 0.0}, kNoEdge).has_value());
}

TEST_CASE("An RGB-D rig has a disparity of f * baseline / z") {
  Camera camera = small_camera();
  camera.T_body_cam.linear() = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitY()).matrix();
  const StereoRig rig = rgbd_rig(camera, 0.08);
  CHECK(rig.depth_source == DepthSource::kDepthImage);
  CHECK(rig.baseline_m() == Approx(0.08));
  const Eigen::Vector3d p_left(0.5, -0.2, 2.0);
  const Eigen::Vector3d p_right = rig.T_left_right().inverse() * p_left;
  const Eigen::Vector2d left = camera.project(p_left.hnormalized()).value();
  const Eigen::Vector2d right = rig.cameras[1].project(p_right.hnormalized()).value();
  CHECK((left - right - Eigen::Vector2d(50.0 * 0.08 / 2.0, 0.0)).norm() < 1e-9);
  for (const double baseline_m : {0.0, -0.1, std::nan("")})
    CHECK_THROWS_AS(rgbd_rig(camera, baseline_m), std::invalid_argument);
}

TEST_CASE("A frame fits a rig if it has the images of the rig") {
  const Camera camera = small_camera();
  const GrayImage image{64, 48, std::vector<std::uint8_t>(64 * 48)};
  const StereoRig rgbd = rgbd_rig(camera, 0.1);
  const StereoRig stereo{{camera, camera}};
  CHECK(fits(StereoFrame{0, image, image}, stereo));
  CHECK_FALSE(fits(StereoFrame{0, image, {}}, stereo));
  CHECK_FALSE(fits(StereoFrame{0, {}, image}, stereo));
  CHECK(fits(StereoFrame{0, image, {}}, rgbd));
  StereoFrame frame{0, image, {}};
  frame.depth = std::make_shared<const DepthImage>(plane_depth(camera, {0, 0, 1}, 1.0));
  CHECK(fits(frame, rgbd));
  frame.depth = std::make_shared<const DepthImage>(DepthImage{64, 47, {}});
  CHECK_FALSE(fits(frame, rgbd));
  GrayImage short_of_pixels = image;
  short_of_pixels.pixels.pop_back();
  CHECK_FALSE(fits(StereoFrame{0, short_of_pixels, {}}, rgbd));
}

}  // namespace
}  // namespace km
