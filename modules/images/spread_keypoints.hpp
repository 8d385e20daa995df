#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "modules/core/data/keyframe.hpp"

namespace km {

/// Corners with their descriptors, which are as many.
struct SpreadKeypoints {
  std::vector<cv::KeyPoint> corners;
  std::vector<BinaryDescriptor> descriptors;
};

/// At most `count` keypoints of make_keypoint_extractor(), evenly spread over `image` (grey), the
/// strongest first (Bailo et al., "Efficient adaptive non-maximal suppression algorithms for
/// homogeneous spatial keypoint distribution", 2018).
[[nodiscard]] SpreadKeypoints spread_keypoints(const cv::Mat& image, int count, int min_contrast);

}  // namespace km
