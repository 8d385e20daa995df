#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <vector>

#include "modules/dense_sensing/stereo_depth.hpp"
#include "modules/images/image_view.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "test/support/keyframe_pairs.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

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
    REQUIRE(pair.status == ImageStatus::kOk);
    add_differences(stereo.compute(pair.image.left, pair.image.right), stereo, rig,
                    triangulated_corners(pair.image, rig), differences);
  }
  CAPTURE(differences.corners, differences.px.size());
  REQUIRE(differences.corners > 300);
  CHECK(static_cast<double>(differences.px.size()) >
        kMinShare * static_cast<double>(differences.corners));
  CHECK(median_of(differences.px) < kMaxMedian_px);
}

TEST_CASE("Dense depth agrees with triangulated corners on MH_01", "[stereo_depth][recorded]") {
  const auto folder = shared_data("euroc/MH_01_easy");
  if (!folder) return;
  ReaderReport report;
  auto pairs = list_euroc_pairs(*folder / "mav0", report).pairs;
  pairs.resize(300);  // 15 s
  check(pairs, read_euroc_rig(*folder / "mav0").stereo, 30, {.downscale = GENERATE(1, 2)});
}

}  // namespace
}  // namespace km
