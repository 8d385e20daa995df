#include "modules/images/spread_keypoints.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "modules/images/keypoint_extractor.hpp"

namespace km {
namespace {

// Candidate corners per kept corner. With more candidates the corners are more evenly spread, and
// the extraction takes longer.
constexpr int kCandidatesPerKeypoint = 4;

// Smaller images have no keypoint, and OpenCV fails if a pyramid level has no pixel.
constexpr int kPatchOfOrb_px = 31;

// Sorts by descending response, then by position, so that the order does not depend on that of the
// detector.
void sort_by_response(std::vector<cv::KeyPoint>& corners) {
  std::sort(corners.begin(), corners.end(), [](const cv::KeyPoint& a, const cv::KeyPoint& b) {
    if (a.response != b.response) return a.response > b.response;
    if (a.pt.y != b.pt.y) return a.pt.y < b.pt.y;
    return a.pt.x < b.pt.x;
  });
}

// The corners, sorted by response, without those that are closer than `radius` to a stronger corner
// of the same octave. The radius grows with the octave. Cells of half the radius make the test
// cheap.
std::vector<cv::KeyPoint> suppressed(const std::vector<cv::KeyPoint>& corners, double radius,
                                     cv::Size size) {
  std::vector<cv::KeyPoint> kept;
  std::vector<std::vector<std::uint8_t>> covered(kPyramidLevels);
  for (const cv::KeyPoint& corner : corners) {
    const double cell = 0.5 * radius * std::pow(static_cast<float>(kPyramidScale), corner.octave);
    const int columns = static_cast<int>(size.width / cell) + 1;
    const int rows = static_cast<int>(size.height / cell) + 1;
    auto& cells = covered[static_cast<std::size_t>(corner.octave)];
    cells.resize(static_cast<std::size_t>(columns * rows), 0);
    const int cx = static_cast<int>(corner.pt.x / cell);
    const int cy = static_cast<int>(corner.pt.y / cell);
    if (cells[static_cast<std::size_t>(cy * columns + cx)] != 0) continue;
    kept.push_back(corner);
    for (int y = std::max(cy - 2, 0); y <= std::min(cy + 2, rows - 1); ++y)
      for (int x = std::max(cx - 2, 0); x <= std::min(cx + 2, columns - 1); ++x)
        cells[static_cast<std::size_t>(y * columns + x)] = 1;
  }
  return kept;
}

// At most `count` corners, evenly spread: suppressed() with the smallest radius that leaves at most
// `count` corners, found by bisection (Bailo et al., "Efficient adaptive non-maximal suppression
// algorithms for homogeneous spatial keypoint distribution", 2018).
std::vector<cv::KeyPoint> spread(std::vector<cv::KeyPoint> corners, std::size_t count,
                                 cv::Size size) {
  sort_by_response(corners);
  if (corners.size() <= count) return corners;
  double low = 1.0;
  double high = 0.25 * std::hypot(size.width, size.height);
  std::vector<cv::KeyPoint> best = suppressed(corners, high, size);
  for (int i = 0; i < 10; ++i) {
    const double radius = 0.5 * (low + high);
    std::vector<cv::KeyPoint> kept = suppressed(corners, radius, size);
    if (kept.size() > count) {
      low = radius;
    } else {
      high = radius;
      best = std::move(kept);
    }
  }
  return best;
}

std::vector<int> by_response(const std::vector<cv::KeyPoint>& corners) {
  std::vector<int> order(corners.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return corners[static_cast<std::size_t>(a)].response >
           corners[static_cast<std::size_t>(b)].response;
  });
  return order;
}

}  // namespace

SpreadKeypoints spread_keypoints(const cv::Mat& image, int count, int min_contrast) {
  if (std::min(image.cols, image.rows) < kPatchOfOrb_px) return {};
  const auto extractor = make_keypoint_extractor(kCandidatesPerKeypoint * count, min_contrast);
  std::vector<cv::KeyPoint> corners;
  extractor->detect(image, corners);
  corners = spread(std::move(corners), static_cast<std::size_t>(count), image.size());
  cv::Mat descriptors;
  extractor->compute(image, corners, descriptors);  // drops keypoints that are too near the border
  SpreadKeypoints result;
  for (const int i : by_response(corners)) {  // OpenCV has sorted them by octave
    result.corners.push_back(corners[static_cast<std::size_t>(i)]);
    result.descriptors.push_back(descriptor_of_row(descriptors, i));
  }
  return result;
}

}  // namespace km
