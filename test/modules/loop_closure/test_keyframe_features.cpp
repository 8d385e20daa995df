#include "modules/images/keypoint_extractor.hpp"
#include "modules/loop_closure/epipolar_matcher.hpp"
#include "modules/loop_closure/keyframe_features.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

Camera test_camera() {
  return {.width = 320,
          .height = 240,
          .fx = 200.0,
          .fy = 202.0,
          .cx = 161.0,
          .cy = 118.0,
          .lens = Lens(LensModel::kRadialTangential, {-0.28, 0.07, 2e-4, 1e-5})};
}

// Squares of random grey levels: corners everywhere.
GrayImage checkered(const Camera& camera) {
  std::mt19937 rng(5);
  std::vector<std::uint8_t> levels(32 * 24);
  for (std::uint8_t& level : levels) level = static_cast<std::uint8_t>(rng() & 0xFFU);
  GrayImage image{camera.width, camera.height, {}};
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x)
      image.pixels.push_back(levels[static_cast<std::size_t>(y / 10 * 32 + x / 10)]);
  return image;
}

const Eigen::Vector3d kNormal(0.2, -0.4, 0.9);
constexpr double kDistance_m = 3.0;

// The plane kNormal . p = kDistance_m, none of it in the left third.
std::shared_ptr<const DepthImage> plane_depth(const Camera& camera) {
  DepthImage image{camera.width, camera.height, {}};
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector2d bearing = *camera.unproject(Eigen::Vector2d(x, y));
      const double z_m = kDistance_m / kNormal.dot(bearing.homogeneous());
      const bool hole = x < camera.width / 3;
      image.millimetres.push_back(hole ? std::uint16_t{0}
                                       : static_cast<std::uint16_t>(std::lround(1e3 * z_m)));
    }
  return std::make_shared<const DepthImage>(std::move(image));
}

TEST_CASE("Descriptors are the rows of the extractor") {
  cv::Mat image(120, 160, CV_8U);
  cv::RNG(7).fill(image, cv::RNG::UNIFORM, 0, 256);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat rows;
  make_keypoint_extractor(50)->detectAndCompute(image, {}, keypoints, rows);
  REQUIRE(rows.rows > 10);
  const std::vector<BinaryDescriptor> descriptors = descriptors_of_rows(rows);
  REQUIRE(descriptors.size() == static_cast<std::size_t>(rows.rows));
  for (int row = 0; row < rows.rows; ++row)
    CHECK(std::equal(rows.ptr(row), rows.ptr(row) + kDescriptorBytes,
                     descriptors[static_cast<std::size_t>(row)].begin()));
  CHECK_THROWS_AS(descriptor_of_row(cv::Mat(1, 61, CV_8U), 0), cv::Exception);
}

TEST_CASE("keypoints of an RGB-D frame have the depth of their pixel") {
  const StereoRig rig = rgbd_rig(test_camera(), 0.08);
  KeyframeFeatureExtractor extractor(rig, {});
  StereoFrame frame{0, checkered(rig.cameras[0]), {}};
  frame.depth = plane_depth(rig.cameras[0]);
  const KeyframeFeatures features = extractor.extract(frame);
  CHECK(features.focal_px == 201.0);
  CHECK(features.baseline_m == Approx(0.08));
  REQUIRE(features.keypoints.size() > 200);
  int holes = 0;
  for (const Keypoint& keypoint : features.keypoints) {
    const Eigen::Vector2d bearing = keypoint.bearing.cast<double>();
    const double x = rig.cameras[0].project(bearing).value().x();
    CAPTURE(x);
    if (x < 106 - 1) {  // a third, less the reach of a neighbour
      ++holes;
      CHECK_FALSE(keypoint.has_depth());
    } else if (x > 107) {
      REQUIRE(keypoint.has_depth());
      // Rounded to millimetres: 1e-3 / z.
      CHECK(bearing.homogeneous().dot(kNormal) / double{keypoint.inverse_depth} ==
            Approx(kDistance_m).epsilon(1e-3));
    }
  }
  CHECK(holes > 20);
}

TEST_CASE("A reduced keyframe has its first keypoints, those with depth before the others") {
  KeyframeFeatures features;
  for (int i = 0; i < 6; ++i) {
    features.keypoints.push_back({.bearing = Eigen::Vector2f(0.1F * static_cast<float>(i), 0.0F),
                                  .inverse_depth = i % 3 == 0 ? 0.0F : 0.5F,  // none for 0 and 3
                                  .octave = 0});
    features.descriptors.emplace_back().fill(static_cast<std::uint8_t>(i));
  }
  const auto numbers = [&](std::size_t count) {
    const KeyframeFeatures some = reduced(features, count);
    REQUIRE(some.keypoints.size() == some.descriptors.size());
    std::vector<int> result;
    for (std::size_t i = 0; i < some.keypoints.size(); ++i) {
      result.push_back(some.descriptors[i][0]);
      CHECK(some.keypoints[i].bearing.x() == 0.1F * static_cast<float>(result.back()));
    }
    return result;
  };
  CHECK(numbers(2) == std::vector<int>{1, 2});
  CHECK(numbers(5) == std::vector<int>{1, 2, 4, 5, 0});
  CHECK(numbers(6) == std::vector<int>{0, 1, 2, 3, 4, 5});
}

TEST_CASE("keypoints without a trusted depth have none") {
  const StereoRig rig = rgbd_rig(test_camera(), 0.08);
  KeyframeFeaturesConfig config{.min_depth_m = 3.0, .max_depth_m = 4.0};
  KeyframeFeatureExtractor extractor(rig, config);
  StereoFrame frame{0, checkered(rig.cameras[0]), {}};
  for (const Keypoint& keypoint : extractor.extract(frame).keypoints)
    CHECK_FALSE(keypoint.has_depth());
  frame.depth = plane_depth(rig.cameras[0]);
  std::size_t trusted = 0;
  for (const Keypoint& keypoint : extractor.extract(frame).keypoints) {
    if (!keypoint.has_depth()) continue;
    ++trusted;
    CHECK(keypoint.inverse_depth >= 0.25F);
    CHECK(keypoint.inverse_depth <= 1.0F / 3.0F);
  }
  CHECK(trusted > 50);
}

TEST_CASE("a frame that does not fit its rig is refused") {
  const StereoRig rgbd = rgbd_rig(test_camera(), 0.08);
  StereoRig stereo = rgbd;
  stereo.depth_source = DepthSource::kRightImage;
  StereoFrame frame{0, checkered(rgbd.cameras[0]), {}};
  CHECK_THROWS_AS(KeyframeFeatureExtractor(stereo, {}).extract(frame), std::invalid_argument);
  frame.depth = std::make_shared<const DepthImage>(DepthImage{320, 200, {}});
  CHECK_THROWS_AS(KeyframeFeatureExtractor(rgbd, {}).extract(frame), std::invalid_argument);
  frame.depth = nullptr;
  frame.left.width = 319;
  CHECK_THROWS_AS(KeyframeFeatureExtractor(rgbd, {}).extract(frame), std::invalid_argument);
}

constexpr double kRigBaseline_m = 0.5;

// With k1 = -0.3 and no k2 the model has its fold at a bearing of 1.05: what lies further out it
// puts where nearer things are seen. Undistorted, the images reach to 1.6 at their sides.
StereoRig folding_rig() {
  StereoRig rig;
  rig.cameras[0] = {.width = 640,
                    .height = 480,
                    .fx = 200.0,
                    .fy = 200.0,
                    .cx = 319.5,
                    .cy = 239.5,
                    .lens = Lens(LensModel::kRadialTangential, {-0.3, 0.0, 0.0, 0.0})};
  rig.cameras[1] = rig.cameras[0];
  rig.cameras[1].T_body_cam.translation().x() = kRigBaseline_m;
  return rig;
}

// A round dot, which looks the same in a mirror, on a grey wall.
GrayImage dot_at(const Eigen::Vector2d& bearing, const Camera& camera) {
  constexpr double kRadius_px = 1.5;
  const Eigen::Vector2d centre = camera.project(bearing).value();
  GrayImage image{camera.width, camera.height, {}};
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const double outside_px = (Eigen::Vector2d(x, y) - centre).norm() - kRadius_px;
      const double share = std::clamp(0.5 - 0.5 * outside_px, 0.0, 1.0);
      image.pixels.push_back(static_cast<std::uint8_t>(std::lround(60.0 + 160.0 * share)));
    }
  return image;
}

// Inverse depth that the matcher finds for a dot at `left` with an inverse depth of `truth` [1/m].
float found(const StereoRig& rig, const Eigen::Vector2d& left, double truth) {
  const EpipolarMatcher matcher(rig, {.min_depth_m = 0.5, .max_depth_m = 10.0});
  StereoFrame frame{
      .left = dot_at(left, rig.cameras[0]),
      .right = dot_at(left - Eigen::Vector2d(kRigBaseline_m * truth, 0.0), rig.cameras[1])};
  const Eigen::Vector2f bearing = left.cast<float>();
  return matcher.inverse_depths(frame, {&bearing, 1}).front();
}

TEST_CASE("The epipolar matcher sees no place twice under folded distortion") {
  const double x = GENERATE(-0.9, -0.8, -0.7);
  CAPTURE(x);
  const StereoRig rig = folding_rig();
  CHECK(found(rig, {x, 0.0}, 0.0) == 0.0F);  // at infinity, farther than is asked for
}

TEST_CASE("Inside the fold of its distortion a lens gives depth") {
  const double x = GENERATE(-0.6, -0.4, 0.0, 0.5);
  CAPTURE(x);
  CHECK(found(folding_rig(), {x, 0.1}, 0.25) == Approx(0.25).epsilon(0.02));
}

}  // namespace
}  // namespace km
