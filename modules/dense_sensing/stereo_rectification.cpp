#include "modules/dense_sensing/stereo_rectification.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace km {
namespace {

PinholeCamera shrunk(PinholeCamera camera, int factor) {
  camera.width /= factor;
  camera.height /= factor;
  camera.fx /= factor;
  camera.fy /= factor;
  // Pixel centres are whole numbers: pixel 0 of the smaller image is the mean of the first ones.
  camera.cx = (camera.cx + 0.5) / factor - 0.5;
  camera.cy = (camera.cy + 0.5) / factor - 0.5;
  return camera;
}

}  // namespace

StereoRectification::StereoRectification(const StereoRig& rig, int downscale)
    : full_(rig, Rectification::Centre::kImage),
      camera_(shrunk(full_.camera(), downscale)),
      baseline_m_(rig.baseline_m()),
      label_size_(rig.cameras[0].width, rig.cameras[0].height),
      seen_(cv::Mat::zeros(camera_.height, camera_.width, CV_8UC1)) {
  for (int y = 0; y < camera_.height; ++y)
    for (int x = 0; x < camera_.width; ++x) {
      const Eigen::Vector3d ray((x - camera_.cx) / camera_.fx, (y - camera_.cy) / camera_.fy, 1.0);
      const auto pixel = seen_pixel(rig.cameras[0], full_.R_left_rect() * ray);
      seen_.at<std::uint8_t>(y, x) = pixel ? 255 : 0;
      left_pixel_.push_back(pixel ? static_cast<std::int32_t>(std::lround(pixel->y())) *
                                            label_size_.width +
                                        static_cast<std::int32_t>(std::lround(pixel->x()))
                                  : kOutside);
    }
}

cv::Mat StereoRectification::rectified(const GrayImage& image, std::size_t side) const {
  cv::Mat full = full_.rectified(image, side);
  if (full.size() == seen_.size()) return full;
  cv::Mat small;
  const int factor = full.cols / camera_.width;
  cv::resize(full(cv::Rect(0, 0, camera_.width * factor, camera_.height * factor)), small,
             seen_.size(), 0.0, 0.0, cv::INTER_AREA);
  return small;
}

LabelImage StereoRectification::rectified(const LabelImage& labels) const {
  CV_Assert(cv::Size(labels.width, labels.height) == label_size_);
  LabelImage result{camera_.width, camera_.height, {}};
  result.ids.reserve(left_pixel_.size());
  for (const std::int32_t index : left_pixel_)
    result.ids.push_back(index == kOutside ? LabelId{0}
                                           : labels.ids[static_cast<std::size_t>(index)]);
  return result;
}

}  // namespace km
