#pragma once

#include <opencv2/core.hpp>
#include <span>

namespace km {

/// Samples on each side of a patch, and their distance in pixels of the corner's pyramid level. A
/// patch is 48 px wide, and ORB's is 31 px.
inline constexpr int kPatchSide = 24;
inline constexpr double kPatchSpacing_px = 2.0;

/// The surroundings of corners of make_keypoint_extractor() in `image` (grey). The result has a row
/// of kPatchSide x kPatchSide bytes for each corner. They are sampled at the level of the corner's
/// octave and turned by its angle, so that a patch hardly depends on scale and roll of the camera.
/// Levels are smoothed before sampling (Gaussian of 1 px). Samples beyond the border repeat it.
[[nodiscard]] cv::Mat keypoint_patches(const cv::Mat& image, std::span<const cv::KeyPoint> corners);

}  // namespace km
