#include "modules/images/keypoint_extractor.hpp"

#include <cstring>

namespace km {

cv::Ptr<cv::Feature2D> make_keypoint_extractor(int max_keypoints, int min_contrast) {
  constexpr int kPatch_px = 31;
  return cv::ORB::create(max_keypoints, static_cast<float>(kPyramidScale), kPyramidLevels,
                         kPatch_px, 0, 2, cv::ORB::HARRIS_SCORE, kPatch_px, min_contrast);
}

BinaryDescriptor descriptor_of_row(const cv::Mat& descriptors, int row) {
  CV_Assert(descriptors.type() == CV_8U && descriptors.cols == int{kDescriptorBytes});
  BinaryDescriptor descriptor;
  std::memcpy(descriptor.data(), descriptors.ptr(row), descriptor.size());
  return descriptor;
}

std::vector<BinaryDescriptor> descriptors_of_rows(const cv::Mat& descriptors) {
  std::vector<BinaryDescriptor> result;
  result.reserve(static_cast<std::size_t>(descriptors.rows));
  for (int row = 0; row < descriptors.rows; ++row)
    result.push_back(descriptor_of_row(descriptors, row));
  return result;
}

}  // namespace km
