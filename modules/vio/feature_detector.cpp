#include "modules/vio/feature_detector.hpp"

#include <cmath>
#include <opencv2/features2d.hpp>

namespace km {
namespace {

// Pixels at the rim without corners, because their windows would exceed the image.
constexpr int kRimPx = 8;
constexpr int kScoreRadius = 3;       // Window of the gradient matrix: 7 x 7.
constexpr float kMinScore = 6.0F;     // Least shi_tomasi_score() [(grey levels per px)^2].
constexpr int kStrongThreshold = 35;  // FAST threshold tried first.

// Smaller eigenvalue of the mean gradient matrix around `px`.
float shi_tomasi_score(const cv::Mat& derivatives, const cv::Point2i& px) {
  int xx = 0;
  int xy = 0;
  int yy = 0;
  for (int y = px.y - kScoreRadius; y <= px.y + kScoreRadius; ++y) {
    const short* row = derivatives.ptr<short>(y) + 2 * (px.x - kScoreRadius);
    for (int i = 0; i <= 2 * kScoreRadius; ++i) {
      const int dx = row[2 * i];
      const int dy = row[2 * i + 1];
      xx += dx * dx >> 5;  // Divided by 32, which kUnit compensates.
      xy += dx * dy >> 5;
      yy += dy * dy >> 5;
    }
  }
  constexpr int kPixels = (2 * kScoreRadius + 1) * (2 * kScoreRadius + 1);
  constexpr float kUnit = 32.0F / (32.0F * 32.0F * static_cast<float>(kPixels));
  const float a = static_cast<float>(xx) * kUnit;
  const float b = static_cast<float>(xy) * kUnit;
  const float c = static_cast<float>(yy) * kUnit;
  return 0.5F * (a + c - std::sqrt((a - c) * (a - c) + 4.0F * b * b));
}

// FAST corners of `cell`, found in it and the ring of pixels that the circle test reads around it.
std::vector<cv::Point2i> fast_corners(const cv::Mat& image, const cv::Rect& cell, int threshold) {
  constexpr int kRing = 4;  // Radius 3, and one more for the non-maximum suppression.
  const cv::Rect window(cell.x - kRing, cell.y - kRing, cell.width + 2 * kRing,
                        cell.height + 2 * kRing);
  std::vector<cv::KeyPoint> corners;
  cv::FAST(image(window), corners, threshold, true);
  std::vector<cv::Point2i> result;
  for (const cv::KeyPoint& corner : corners) {
    const cv::Point2i px = cv::Point2i(corner.pt) + window.tl();
    if (cell.contains(px)) result.push_back(px);
  }
  return result;
}

}  // namespace

void FeatureDetector::add_corners_of(const cv::Rect& cell, int features_there,
                                     const ImagePyramid& image) {
  std::vector<Candidate> found;
  for (const int threshold :
       {std::max(kStrongThreshold, config_.fast_threshold), config_.fast_threshold}) {
    for (const cv::Point2i& px : fast_corners(image.level(0), cell, threshold)) {
      const float score = shi_tomasi_score(image.derivatives(), px);
      if (score >= kMinScore) found.push_back({px, score, 0});
    }
    if (!found.empty()) break;
  }
  std::sort(found.begin(), found.end(), Candidate::better);
  for (Candidate& candidate : found) candidate.rank = features_there++;
  candidates_.insert(candidates_.end(), found.begin(), found.end());
}

void FeatureDetector::take_best(int count, DistanceGrid& grid,
                                std::vector<Eigen::Vector2f>& taken) const {
  for (const Candidate& candidate : candidates_) {
    if (static_cast<int>(taken.size()) == count) break;
    const Eigen::Vector2f px(static_cast<float>(candidate.px.x),
                             static_cast<float>(candidate.px.y));
    if (!grid.is_free(px)) continue;
    grid.add(px);
    taken.push_back(px);
  }
}

std::vector<Eigen::Vector2f> FeatureDetector::detect(const ImagePyramid& image,
                                                     std::span<const Eigen::Vector2f> occupied,
                                                     int count) {
  std::vector<Eigen::Vector2f> result;
  const cv::Size size = image.level(0).size();
  const cv::Rect inside(kRimPx, kRimPx, size.width - 2 * kRimPx, size.height - 2 * kRimPx);
  if (count <= 0 || inside.width <= 0 || inside.height <= 0) return result;

  // One cell for each feature.
  const int side = std::max(8, static_cast<int>(std::sqrt(inside.area() / config_.max_features)));
  const int columns = (inside.width + side - 1) / side;
  const int rows = (inside.height + side - 1) / side;
  std::vector<int> features(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0);
  DistanceGrid grid(size, static_cast<float>(config_.min_distance_px));
  for (const Eigen::Vector2f& px : occupied) {
    grid.add(px);
    const int column = std::clamp((static_cast<int>(px.x()) - kRimPx) / side, 0, columns - 1);
    const int row = std::clamp((static_cast<int>(px.y()) - kRimPx) / side, 0, rows - 1);
    ++features[static_cast<std::size_t>(row * columns + column)];
  }

  // Cells with features follow only if the cells without features do not suffice.
  for (int there = 0; there < kFullCell && static_cast<int>(result.size()) < count; ++there) {
    candidates_.clear();
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        if (features[static_cast<std::size_t>(row * columns + column)] != there) continue;
        const cv::Point2i corner(kRimPx + column * side, kRimPx + row * side);
        add_corners_of(cv::Rect(corner, cv::Size(side, side)) & inside, there, image);
      }
    }
    std::sort(candidates_.begin(), candidates_.end(), Candidate::earlier);
    take_best(count, grid, result);
  }
  return result;
}

}  // namespace km
