#include "modules/diagnosis/forward_backward.hpp"

#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <utility>

namespace km {
namespace {

const cv::Size kWindow_px(21, 21);
constexpr int kTopLevel = 3;  // levels 0 to 3
constexpr double kCornerQuality = 0.01;
constexpr double kCornerDistance_px = 15.0;

// Tracks points from `from`, starting the search at `to`, and stores the results in `to`; 0: lost.
std::vector<unsigned char> track(const KltImage& a, const KltImage& b,
                                 const std::vector<cv::Point2f>& from,
                                 std::vector<cv::Point2f>& to) {
  std::vector<unsigned char> status;
  std::vector<float> residuals;
  const cv::TermCriteria criteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 0.01);
  cv::calcOpticalFlowPyrLK(a.pyramid, b.pyramid, from, to, status, residuals, kWindow_px, kTopLevel,
                           criteria, cv::OPTFLOW_USE_INITIAL_FLOW);
  return status;
}

}  // namespace

KltImage make_klt_image(const cv::Mat& image) {
  KltImage result;
  result.image = image.clone();
  cv::buildOpticalFlowPyramid(result.image, result.pyramid, kWindow_px, kTopLevel);
  return result;
}

std::vector<ForwardBackward> forward_backward(const KltImage& a, const KltImage& b,
                                              const std::vector<cv::Point2f>& points,
                                              std::vector<cv::Point2f> starts_b) {
  if (points.empty()) return {};
  const bool far = !starts_b.empty();
  std::vector<cv::Point2f> there = far ? std::move(starts_b) : points;
  const auto there_status = track(a, b, points, there);
  std::vector<cv::Point2f> back = far ? points : there;
  const auto back_status = track(b, a, there, back);
  std::vector<ForwardBackward> tracks(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const cv::Point2f off = back[i] - points[i];
    const bool lost = there_status[i] == 0 || back_status[i] == 0;
    tracks[i] = {there[i],
                 lost ? std::numeric_limits<double>::infinity() : std::hypot(off.x, off.y)};
  }
  return tracks;
}

std::vector<cv::Point2f> corners_of(const cv::Mat& image) {
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(image, corners, 0, kCornerQuality, kCornerDistance_px);
  return corners;
}

}  // namespace km
