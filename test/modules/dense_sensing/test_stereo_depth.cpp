#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "modules/core/geometry/lie.hpp"
#include "modules/dense_sensing/stereo_depth.hpp"
#include "modules/images/image_view.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "test/modules/vio/textured_plane.hpp"
#include "test/support/keyframe_pairs.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kMatchedMedian_px = 0.12;  // disparity; the matcher's steps are a sixteenth
constexpr double kMatchedShare = 0.85;      // share of the pixels that can have depth

struct DepthError {
  double median_px = 0.0;  // in disparity
  // Share of the pixels with depth that are in both images.
  double share = 0.0;
};

// Accuracy against the true distance of `plane` along the axis of the depth camera.
DepthError compare(const DepthImage& depth, const StereoDepth& stereo, const TexturedPlane& plane,
                   const SE3& T_world_body) {
  const Camera& camera = stereo.camera();
  const SE3 T_world_cam = T_world_body * camera.T_body_cam;
  const double focal_baseline = camera.fx * stereo.rectification().baseline_m();
  std::vector<double> errors_px;
  int possible = 0;
  for (int y = 0; y < depth.height; ++y)
    for (int x = 0; x < depth.width; ++x) {
      const auto pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(depth.width) +
                         static_cast<std::size_t>(x);
      const auto bearing = camera.unproject(Eigen::Vector2d(x, y));
      const double z_m = (T_world_cam.inverse() * plane.meet(T_world_cam, *bearing)).z();
      const double disparity_px = focal_baseline / z_m;
      if (x < disparity_px) continue;
      ++possible;
      if (depth.millimetres[pixel] == 0) continue;
      errors_px.push_back(
          std::abs(focal_baseline / (1e-3 * depth.millimetres[pixel]) - disparity_px));
    }
  DepthError error{1e9, static_cast<double>(errors_px.size()) / possible};
  if (errors_px.empty()) return error;
  const auto middle = errors_px.begin() + static_cast<std::ptrdiff_t>(errors_px.size() / 2);
  std::nth_element(errors_px.begin(), middle, errors_px.end());
  error.median_px = *middle;
  return error;
}

DepthError error_on(const StereoRig& rig, const StereoDepthConfig& config,
                    const TexturedPlane& plane, const SE3& T_world_body) {
  StereoDepth stereo(rig, config);
  const StereoFrame frame = plane.render(rig, T_world_body, 0);
  return compare(stereo.compute(frame.left, frame.right), stereo, plane, T_world_body);
}

TEST_CASE("With any lens a plane has the right depth") {
  struct Case {
    double focal_px;
    Lens lens;
  };
  // Fisheye lenses of 144, 136 and 144 degrees across.
  const Case c = GENERATE(Case{150.0, Lens(LensModel::kEquidistant, {0.003, 7e-4, -2e-3, 2e-4})},
                          Case{190.0, Lens(LensModel::kOmnidirectional, {0.8, -0.1, 0, 1e-4, 0})},
                          Case{150.0, Lens(LensModel::kDoubleSphere, {-0.17, 0.59})});
  CAPTURE(to_string(c.lens.model()));
  StereoRig rig = test_rig();
  for (Camera& camera : rig.cameras) {
    camera.fx = camera.fy = c.focal_px;
    camera.lens = c.lens;
  }
  rig.cameras[1].T_body_cam =
      make_pose(so3_exp(Eigen::Vector3d(0.02, -0.03, 0.025)), {0.11, 0.004, -0.003});
  const DepthError error = error_on(rig, {}, TexturedPlane{2.0, 0.1, 1}, SE3::Identity());
  CHECK(error.median_px < kMatchedMedian_px);
  CHECK(error.share > kMatchedShare);
}

TEST_CASE("A fisheye lens of 190 degrees is rectified to a view of some 120") {
  StereoRig rig = test_rig();
  for (Camera& camera : rig.cameras) {
    camera.fx = camera.fy = 0.5 * camera.width / (95.0 * M_PI / 180.0);
    camera.lens = Lens(LensModel::kEquidistant, {0.0, 0.0, 0.0, 0.0});
  }
  const StereoRectification rectification(rig, 1);
  const Camera& camera = rectification.camera();
  const double left = camera.unproject({0.0, camera.cy}).value().x();
  const double right = camera.unproject({camera.width - 1.0, camera.cy}).value().x();
  CHECK((std::atan(right) - std::atan(left)) * 180.0 / M_PI == Approx(118.0).margin(2.0));
  CHECK(cv::countNonZero(rectification.seen()) == camera.width * camera.height);
}

TEST_CASE("Cameras that are rotated and have different lenses are rectified") {
  StereoRig rig = test_rig();
  rig.cameras[1].T_body_cam =
      make_pose(so3_exp(Eigen::Vector3d(0.02, -0.03, 0.025)), {0.11, 0.004, -0.003});
  rig.cameras[1].cx += 9.0;
  rig.cameras[1].cy -= 6.0;
  rig.cameras[1].fx *= 1.03;
  rig.cameras[1].lens = Lens(LensModel::kRadialTangential, {-0.25, 0.05, -3e-4, 2e-4});
  const DepthError error = error_on(rig, {}, TexturedPlane{}, SE3::Identity());
  CHECK(error.median_px < kMatchedMedian_px);
  CHECK(error.share > kMatchedShare);
}

TEST_CASE("Depth out of range is dropped") {
  StereoDepthConfig config{.max_depth_m = 1.5};
  CHECK(error_on(test_rig(), config, TexturedPlane{}, SE3::Identity()).share < 0.01);
}

TEST_CASE("Rigs and depth ranges without disparities to search are refused") {
  const StereoRig rig = test_rig();
  CHECK_THROWS_AS(StereoDepth(rgbd_rig(rig.cameras[0], 0.1), {}), std::invalid_argument);
  StereoRig swapped = rig;
  std::swap(swapped.cameras[0].T_body_cam, swapped.cameras[1].T_body_cam);
  CHECK_THROWS_WITH(StereoDepth(swapped, {}), Contains("be to its right"));
  StereoRig crossed = rig;
  crossed.cameras[1].T_body_cam.linear() = so3_exp(Eigen::Vector3d(0.0, 1.0, 0.0));
  CHECK_THROWS_WITH(StereoDepth(crossed, {}), Contains("must have the direction of the left one"));
  StereoDepthConfig config{.min_depth_m = 20.0};
  CHECK_THROWS_AS(StereoDepth(rig, config), ConfigError);
  config = {};
  config.min_depth_m = 5.0;
  config.max_depth_m = 4.0;
  CHECK_THROWS_WITH(StereoDepth(rig, config), Contains("not below max_depth_m"));
  config = {};
  config.min_depth_m = 0.1;  // 253 px
  CHECK(StereoDepth(rig, config).disparities() < rig.cameras[0].width / 2 + 17);
}

// Largest difference between two methods of matching with the same calibration.
constexpr double kMaxMedian_px = 0.35;
constexpr double kMinShare = 0.75;  // least share of the corners with dense depth

// Corners of a raw stereo pair, matched to the other image and back by optical flow, and
// triangulated as the nearest point of both rays. Uses only OpenCV's functions and nothing that is
// tested. A corner is kept if its rays pass within `max_gap` [bearing] and its depth is within [1,
// 10] m.
std::vector<Eigen::Vector3d> triangulated_corners(const StereoFrame& frame, const StereoRig& rig,
                                                  double max_gap = 0.0015) {
  const cv::Mat left = view(frame.left), right = view(frame.right);
  std::vector<cv::Point2f> corners, found, back;
  cv::goodFeaturesToTrack(left, corners, 400, 0.01, 12.0);
  std::vector<std::uint8_t> ok, ok_back;
  std::vector<float> error;
  if (corners.empty()) return {};
  cv::calcOpticalFlowPyrLK(left, right, corners, found, ok, error, {21, 21}, 4);
  cv::calcOpticalFlowPyrLK(right, left, found, back, ok_back, error, {21, 21}, 4);
  const SE3 T_left_right = rig.T_left_right();
  std::vector<Eigen::Vector3d> result;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (ok[i] == 0 || ok_back[i] == 0 || cv::norm(back[i] - corners[i]) > 0.3) continue;
    const auto a = rig.cameras[0].unproject({corners[i].x, corners[i].y});
    const auto b = rig.cameras[1].unproject({found[i].x, found[i].y});
    if (!a || !b) continue;
    const Eigen::Vector3d ray_a = a->homogeneous();
    const Eigen::Vector3d ray_b = T_left_right.linear() * b->homogeneous();
    Eigen::Matrix<double, 3, 2> A;
    A << ray_a, -ray_b;
    const Eigen::Vector2d s =
        (A.transpose() * A).ldlt().solve(A.transpose() * T_left_right.translation());
    const double gap = (A * s - T_left_right.translation()).norm();
    if (s[0] < 1.0 || s[0] > 10.0 || gap / s[0] > max_gap) continue;
    result.emplace_back(s[0] * ray_a);
  }
  return result;
}

// Differences between dense depth and the depth of corners, in disparity.
struct DepthDifferences {
  std::vector<double> px;
  std::size_t corners = 0;
};

void add_differences(const DepthImage& depth, const StereoDepth& stereo, const StereoRig& rig,
                     const std::vector<Eigen::Vector3d>& corners, DepthDifferences& differences) {
  const Camera& camera = stereo.camera();
  const SE3 T_cam_left = camera.T_body_cam.inverse() * rig.cameras[0].T_body_cam;
  const double focal_baseline = camera.fx * stereo.rectification().baseline_m();
  for (const Eigen::Vector3d& corner : corners) {
    const Eigen::Vector3d p = T_cam_left * corner;
    const Eigen::Vector2d px = camera.project(p.hnormalized()).value();
    const long x = std::lround(px.x()), y = std::lround(px.y());
    if (x < stereo.disparities() || y < 0 || x >= depth.width || y >= depth.height) continue;
    ++differences.corners;
    const double z_m = 1e-3 * depth.millimetres[static_cast<std::size_t>(y * depth.width + x)];
    if (z_m == 0.0) continue;
    differences.px.push_back(std::abs(focal_baseline / z_m - focal_baseline / p.z()));
  }
}

double median_of(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::infinity();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Checks every `every`-th pair.
void check(const std::vector<StereoPairFile>& pairs, const StereoRig& rig, std::size_t every,
           const StereoDepthConfig& config) {
  StereoDepth stereo(rig, config);
  DepthDifferences differences;
  for (std::size_t i = 0; i < pairs.size(); i += every) {
    const auto pair = load_stereo_pair(pairs[i], rig);
    REQUIRE(!pair.fault);
    add_differences(stereo.compute(pair.image.left, pair.image.right), stereo, rig,
                    triangulated_corners(pair.image, rig), differences);
  }
  CAPTURE(differences.corners, differences.px.size());
  REQUIRE(differences.corners > 300);
  CHECK(static_cast<double>(differences.px.size()) >
        kMinShare * static_cast<double>(differences.corners));
  CHECK(median_of(differences.px) < kMaxMedian_px);
}

TEST_CASE("Dense depth agrees with triangulated corners on MH_01") {
  const auto folder = shared_data("euroc/MH_01_easy");
  if (!folder) return;
  ReaderReport report;
  auto pairs = list_euroc_pairs(*folder / "mav0", report).pairs;
  pairs.resize(300);  // 15 s
  check(pairs, read_euroc_rig(*folder / "mav0").stereo, 30, {.downscale = GENERATE(1, 2)});
}

}  // namespace
}  // namespace km
