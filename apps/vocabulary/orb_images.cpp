#include "apps/vocabulary/orb_images.hpp"

#include <cstring>
#include <iostream>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

namespace km {

std::vector<OrbDescriptor> orb_descriptors(const std::filesystem::path& image, int features) {
  const cv::Mat grey = cv::imread(image.string(), cv::IMREAD_GRAYSCALE);
  if (grey.empty()) throw std::runtime_error(image.string() + " cannot be decoded as an image");
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  cv::ORB::create(features)->detectAndCompute(grey, cv::noArray(), keypoints, descriptors);
  std::vector<OrbDescriptor> result(static_cast<std::size_t>(descriptors.rows));
  for (int i = 0; i < descriptors.rows; ++i)
    std::memcpy(result[static_cast<std::size_t>(i)].data(), descriptors.ptr(i),
                sizeof(OrbDescriptor));
  return result;
}

std::vector<std::vector<OrbDescriptor>> orb_descriptors(
    std::span<const std::filesystem::path> images, int features) {
  std::vector<std::vector<OrbDescriptor>> result;
  for (const auto& image : images) {
    result.push_back(orb_descriptors(image, features));
    if (result.size() % 50 == 0 || result.size() == images.size())
      std::cerr << "ORB: " << result.size() << " of " << images.size() << " images\n";
  }
  return result;
}

}  // namespace km
