#include "modules/dense_sensing/stereo_depth.hpp"

#include <cmath>
#include <string>
#include <utility>

#include "modules/dense_sensing/disparity_refinement.hpp"

namespace km {
namespace {

constexpr int kDisparityUnit = 16;  // the matcher searches multiples of it

StereoDepthConfig checked_depths(StereoDepthConfig config) {
  config = checked(config);
  std::string problems;
  if (config.block_px % 2 == 0)
    problems += "stereo_depth.block_px = " + std::to_string(config.block_px) + " is not odd\n";
  if (!(config.min_depth_m < config.max_depth_m))
    problems += "stereo_depth.min_depth_m is not below max_depth_m\n";
  if (!problems.empty()) throw ConfigError(problems);
  return config;
}

int disparity_count(const StereoRectification& rectification, const StereoDepthConfig& config) {
  const double largest_px =
      rectification.camera().fx * rectification.baseline_m() / config.min_depth_m;
  const int units = static_cast<int>(std::ceil((largest_px + 1.0) / kDisparityUnit));
  if (units * kDisparityUnit >= rectification.camera().width)
    throw ConfigError("stereo_depth.min_depth_m = " + std::to_string(config.min_depth_m) +
                      ": the disparity there, " + std::to_string(std::lround(largest_px)) +
                      " px, is as wide as the image");
  return units * kDisparityUnit;
}

// The smoothness penalties are those OpenCV's documentation proposes, for one channel.
cv::Ptr<cv::StereoSGBM> make_matcher(const StereoDepthConfig& config, int disparities) {
  const int area = config.block_px * config.block_px;
  constexpr int kPrefilterCap = 31;
  constexpr int kSpeckleStep_px = 1;
  return cv::StereoSGBM::create(0, disparities, config.block_px, 8 * area, 32 * area,
                                config.max_left_right_px, kPrefilterCap, config.uniqueness_percent,
                                config.speckle_px, kSpeckleStep_px, cv::StereoSGBM::MODE_SGBM_3WAY);
}

}  // namespace

StereoDepth::StereoDepth(const StereoRig& rig, const StereoDepthConfig& config)
    : config_(checked_depths(config)),
      rectification_(rig, config_.downscale),
      disparities_(disparity_count(rectification_, config_)),
      matcher_(make_matcher(config_, disparities_)) {}

DepthImage StereoDepth::compute(const GrayImage& left, const GrayImage& right) {
  const cv::Mat rectified_left = rectification_.rectified(left, 0);
  const cv::Mat rectified_right = rectification_.rectified(right, 1);
  cv::Mat steps;
  matcher_->compute(rectified_left, rectified_right, steps);
  DepthImage depth{camera().width, camera().height, {}};
  fill(refined_disparities(rectified_left, rectified_right, steps), depth);
  return depth;
}

void StereoDepth::fill(const cv::Mat& disparities_px, DepthImage& depth) const {
  const auto depth_of_one_px = static_cast<float>(1e3 * camera().fx * rectification_.baseline_m());
  const auto min_mm = static_cast<float>(1e3 * config_.min_depth_m);
  const auto max_mm = static_cast<float>(1e3 * config_.max_depth_m);
  depth.millimetres.reserve(disparities_px.total());
  for (int y = 0; y < disparities_px.rows; ++y) {
    const auto* disparity = disparities_px.ptr<float>(y);
    const auto* seen = rectification_.seen().ptr(y);
    for (int x = 0; x < disparities_px.cols; ++x) {
      const float z_mm = depth_of_one_px / disparity[x];  // infinite for none
      const bool used = seen[x] != 0 && min_mm <= z_mm && z_mm <= max_mm;
      depth.millimetres.push_back(used ? static_cast<std::uint16_t>(z_mm + 0.5F) : 0);
    }
  }
}

}  // namespace km
