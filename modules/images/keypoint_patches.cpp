#include "modules/images/keypoint_patches.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "modules/images/keypoint_extractor.hpp"

namespace km {
namespace {

double scale_of(int octave) {
  return std::pow(kPyramidScale, octave);
}

// The first `octaves` levels of the image's pyramid, smoothed. A level is made from the one before,
// because making it from the image takes longer.
std::vector<cv::Mat> smoothed_levels(const cv::Mat& image, int octaves) {
  std::vector<cv::Mat> levels;
  cv::Mat level = image;
  for (int octave = 0; octave < octaves; ++octave) {
    if (octave > 0) {
      const double scale = scale_of(octave);
      const cv::Size size(cvRound(image.cols / scale), cvRound(image.rows / scale));
      cv::Mat smaller;
      cv::resize(level, smaller, size, 0.0, 0.0, cv::INTER_LINEAR);
      level = smaller;
    }
    cv::GaussianBlur(level, levels.emplace_back(), {5, 5}, 1.0);
  }
  return levels;
}

void sample(const cv::Mat& level, const cv::KeyPoint& corner, std::uint8_t* patch) {
  const double scale = scale_of(corner.octave);
  const double angle = static_cast<double>(corner.angle) * std::numbers::pi / 180.0;
  const auto step_x = static_cast<float>(kPatchSpacing_px * std::cos(angle));
  const auto step_y = static_cast<float>(kPatchSpacing_px * std::sin(angle));
  constexpr float kHalf = 0.5F * (kPatchSide - 1);
  // The first sample; pixels are rounded down, hence the half.
  float row_x = static_cast<float>(corner.pt.x / scale) - kHalf * (step_x - step_y) + 0.5F;
  float row_y = static_cast<float>(corner.pt.y / scale) - kHalf * (step_y + step_x) + 0.5F;
  const auto last_x = static_cast<float>(level.cols - 1);
  const auto last_y = static_cast<float>(level.rows - 1);
  for (int v = 0; v < kPatchSide; ++v) {
    float x = row_x, y = row_y;
    for (int u = 0; u < kPatchSide; ++u) {
      const auto column = static_cast<int>(std::clamp(x, 0.0F, last_x));
      const auto row = static_cast<int>(std::clamp(y, 0.0F, last_y));
      *patch++ = level.ptr(row)[column];
      x += step_x;
      y += step_y;
    }
    row_x -= step_y;
    row_y += step_x;
  }
}

}  // namespace

cv::Mat keypoint_patches(const cv::Mat& image, std::span<const cv::KeyPoint> corners) {
  CV_Assert(image.type() == CV_8U);
  int octaves = 0;
  for (const cv::KeyPoint& corner : corners) octaves = std::max(octaves, corner.octave + 1);
  const std::vector<cv::Mat> levels = smoothed_levels(image, octaves);
  cv::Mat patches(static_cast<int>(corners.size()), kPatchSide * kPatchSide, CV_8U);
  for (std::size_t i = 0; i < corners.size(); ++i)
    sample(levels[static_cast<std::size_t>(corners[i].octave)], corners[i],
           patches.ptr(static_cast<int>(i)));
  return patches;
}

}  // namespace km
