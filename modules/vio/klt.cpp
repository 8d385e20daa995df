#include "modules/vio/klt.hpp"

#include <opencv2/video/tracking.hpp>

namespace km {
namespace {

constexpr int kMaxSteps = 8;
constexpr double kStopPx = 0.05;         // AlignmentPatch does the rest.
constexpr double kMinEigenvalue = 1e-4;  // As OpenCV scales it: rejects flat windows.

std::vector<cv::Point2f> to_cv(std::span<const Eigen::Vector2f> points) {
  std::vector<cv::Point2f> result;
  result.reserve(points.size());
  for (const Eigen::Vector2f& p : points) result.emplace_back(p.x(), p.y());
  return result;
}

}  // namespace

KltResult track_klt(const ImagePyramid& from, const ImagePyramid& to,
                    std::span<const Eigen::Vector2f> points,
                    std::span<const Eigen::Vector2f> starts, int window_px, int levels) {
  KltResult result;
  if (points.empty()) return result;
  std::vector<cv::Point2f> there = to_cv(starts);
  std::vector<unsigned char> status;
  const cv::TermCriteria stop(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, kMaxSteps, kStopPx);
  cv::calcOpticalFlowPyrLK(from.maps(), to.maps(), to_cv(points), there, status, cv::noArray(),
                           cv::Size(window_px, window_px), levels, stop,
                           cv::OPTFLOW_USE_INITIAL_FLOW, kMinEigenvalue);
  const cv::Size size = to.level(0).size();
  for (std::size_t i = 0; i < there.size(); ++i) {
    const bool inside = there[i].x >= 0.0F && there[i].y >= 0.0F &&
                        there[i].x <= static_cast<float>(size.width - 1) &&
                        there[i].y <= static_cast<float>(size.height - 1);
    result.px.emplace_back(there[i].x, there[i].y);
    result.found.push_back(status[i] != 0 && inside);
  }
  return result;
}

}  // namespace km
