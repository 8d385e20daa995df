#include <Eigen/LU>

#include "modules/core/geometry/lie.hpp"
#include "modules/vio/patches.hpp"
#include "test/support/test.hpp"
#include "textured_plane.hpp"

namespace km {
namespace {

// The texture warped so that texture point A^-1 (px - centre) is seen at px, scaled in contrast.
cv::Mat warped_texture(const Eigen::Matrix2f& A, const Eigen::Vector2f& centre, double gain,
                       double offset) {
  cv::Mat image(120, 160, CV_8UC1);
  const Eigen::Matrix2f A_inverse = A.inverse();
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const Eigen::Vector2f p =
          A_inverse * (Eigen::Vector2f(static_cast<float>(x), static_cast<float>(y)) - centre);
      const double value = 255.0 * smooth_noise(p.x() / 6.0 + 40.0, p.y() / 6.0 + 40.0, 7);
      image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(std::lround(gain * value + offset));
    }
  }
  return image;
}

TEST_CASE("A patch is aligned under a known warp and in other light") {
  const Eigen::Vector2f centre(80.0F, 60.0F);
  const cv::Mat reference = warped_texture(Eigen::Matrix2f::Identity(), centre, 1.0, 0.0);
  Eigen::Matrix2f A = Eigen::Matrix2f::Identity();
  const float turn = GENERATE(0.0F, 0.3F);
  const float scale = GENERATE(1.0F, 1.25F);
  A << scale * std::cos(turn), -std::sin(turn), std::sin(turn), std::cos(turn);
  const Eigen::Vector2f moved(83.37F, 57.81F);
  const cv::Mat image = warped_texture(A, moved, 0.6, 40.0);
  const auto patch = AlignmentPatch::cut(reference, centre);
  REQUIRE(patch);
  const auto found = patch->align(image, moved + Eigen::Vector2f(1.4F, -1.1F), A);
  REQUIRE(found);
  // 8-bit levels in 169 pixels and bilinear sampling.
  CHECK((found->px - moved).norm() < 0.05F);
  CHECK(found->correlation > 0.99F);
}

TEST_CASE("A patch is not aligned with other texture") {
  const Eigen::Vector2f centre(80.0F, 60.0F);
  const Eigen::Matrix2f I = Eigen::Matrix2f::Identity();
  const cv::Mat image = warped_texture(I, centre, 1.0, 0.0);
  const auto patch = AlignmentPatch::cut(image, centre);
  REQUIRE(patch);
  const cv::Mat flat(120, 160, CV_8UC1, cv::Scalar(90));
  CHECK_FALSE(patch->align(flat, centre, I));
  CHECK_FALSE(patch->align(image, {3.0F, 60.0F}, I));  // Over the rim.
  CHECK_FALSE(patch->align(image, {158.0F, 60.0F}, I));
  const auto elsewhere = patch->align(image, {40.0F, 30.0F}, I);
  CHECK((!elsewhere || elsewhere->correlation < 0.8F));
  CHECK_FALSE(AlignmentPatch::cut(flat, centre));
  CHECK_FALSE(AlignmentPatch::cut(image, {2.0F, 60.0F}));
  CHECK_FALSE(AlignmentPatch::cut(image, {80.0F, 119.0F}));
}

TEST_CASE("The local warp is the derivative of the image of a facing surface") {
  const bool fisheye = GENERATE(false, true);
  CAPTURE(fisheye);
  const StereoRig rig = fisheye ? fisheye_rig() : test_rig();
  const Camera& camera = rig.cameras[0];
  Vector6 xi;
  xi << 0.02, -0.05, 0.2, 0.05, 0.02, 0.2;
  const SE3 T_b_a = se3_exp(xi);
  const Eigen::Vector2d px_a(120.0, 90.0);
  const Eigen::Vector2d bearing = camera.unproject(px_a).value();
  const auto in_b = [&](const Eigen::Vector2d& px) {
    const Eigen::Vector3d p = 1.5 * camera.unproject(px).value().homogeneous();
    return camera.project((T_b_a * p).hnormalized()).value();
  };
  const Eigen::Matrix2f A = local_warp(camera, camera, bearing, 1.0 / 1.5, T_b_a);
  const Eigen::Vector2d offset(1.5, -1.0);
  const Eigen::Vector2d expected = in_b(px_a + offset) - in_b(px_a);
  CHECK((A.cast<double>() * offset - expected).norm() < 0.02);  // Second order.
  const SE3 behind = make_pose(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, 0, -2.0));
  CHECK(local_warp(camera, camera, bearing, 1.0 / 1.5, behind).isIdentity());
  // Next to bearings outside the field of view of the lens.
  const Eigen::Vector2d rim(camera.lens.max_bearing() - 1e-4, 0.0);
  CHECK(local_warp(camera, camera, rim, 0.0, SE3::Identity()).isIdentity());
}

}  // namespace
}  // namespace km
