#include "modules/dense_sensing/stereo_rectification.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>
#include <string>

namespace km {
namespace {

constexpr double kMinAlignment = 0.87;  // cosine of 30 degrees

void require_usable(const StereoRig& rig) {
  if (rig.depth_source != DepthSource::kRightImage)
    throw std::invalid_argument("stereo depth: the rig has no right camera");
  for (const PinholeCamera& camera : rig.cameras)
    if (camera.width <= 0 || camera.height <= 0 || !(camera.fx > 0.0) || !(camera.fy > 0.0))
      throw std::invalid_argument("stereo depth: a camera without pixels or focal length");
}

// Axes of the virtual cameras in the left one: x along the baseline, z midway between both real
// ones as far as x leaves it free.
Eigen::Matrix3d virtual_axes(const StereoRig& rig) {
  const SE3 T_left_right = rig.T_left_right();
  const Eigen::Vector3d x = T_left_right.translation().normalized();
  const Eigen::Vector3d z_right = T_left_right.linear().col(2);
  if (!(z_right.z() > kMinAlignment) || !(x.x() > kMinAlignment))
    throw std::invalid_argument(
        "stereo depth: the right camera must look the way of the left one and stand to its right");
  const Eigen::Vector3d y = (Eigen::Vector3d::UnitZ() + z_right).cross(x).normalized();
  Eigen::Matrix3d R_left_virtual;
  R_left_virtual << x, y, x.cross(y);
  return R_left_virtual;
}

PinholeCamera virtual_camera(const PinholeCamera& left, const Eigen::Matrix3d& R_left_virtual) {
  PinholeCamera camera;
  camera.width = left.width;
  camera.height = left.height;
  camera.fx = camera.fy = 0.5 * (left.fx + left.fy);
  camera.cx = 0.5 * (left.width - 1);
  camera.cy = 0.5 * (left.height - 1);
  camera.T_body_cam = left.T_body_cam * make_pose(R_left_virtual, Eigen::Vector3d::Zero());
  return camera;
}

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

// Where the pixel of the virtual camera lies in the real one [px]; nullopt outside of its image.
// R_real_virtual turns bearings.
std::optional<Eigen::Vector2d> real_pixel(const PinholeCamera& camera, double x, double y,
                                          const PinholeCamera& real,
                                          const Eigen::Matrix3d& R_real_virtual) {
  const Eigen::Vector3d ray = R_real_virtual * Eigen::Vector3d((x - camera.cx) / camera.fx,
                                                               (y - camera.cy) / camera.fy, 1.0);
  if (ray.z() <= 0.0) return std::nullopt;
  const Eigen::Vector2d bearing = ray.hnormalized();
  const Eigen::Vector2d pixel = real.project(bearing);
  if (!(pixel.x() >= 0.0 && pixel.x() <= real.width - 1.0 && pixel.y() >= 0.0 &&
        pixel.y() <= real.height - 1.0))
    return std::nullopt;
  // The distortion's polynomial folds back far outside: only what leads back to it is seen.
  const auto back = real.unproject(pixel);
  if (!back || (*back - bearing).norm() > 1e-6) return std::nullopt;
  return pixel;
}

cv::Mat header(const GrayImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels.data())};
}

}  // namespace

StereoRectification::StereoRectification(const StereoRig& rig, int downscale) {
  require_usable(rig);
  const Eigen::Matrix3d R_left_virtual = virtual_axes(rig);
  const PinholeCamera full = virtual_camera(rig.cameras[0], R_left_virtual);
  camera_ = shrunk(full, downscale);
  baseline_m_ = rig.baseline_m();
  const Eigen::Matrix3d R_right_left = rig.T_left_right().linear().transpose();
  for (std::size_t side = 0; side < 2; ++side) {
    const PinholeCamera& real = rig.cameras[side];
    const Eigen::Matrix3d R = side == 0 ? R_left_virtual : R_right_left * R_left_virtual;
    cv::Mat map(full.height, full.width, CV_32FC2);
    for (int y = 0; y < full.height; ++y)
      for (int x = 0; x < full.width; ++x) {
        const auto pixel = real_pixel(full, x, y, real, R);
        map.at<cv::Vec2f>(y, x) =
            pixel ? cv::Vec2f(static_cast<float>(pixel->x()), static_cast<float>(pixel->y()))
                  : cv::Vec2f(-2.0F, -2.0F);  // remap() makes it 0
      }
    cv::convertMaps(map, cv::noArray(), maps_[side], map_fractions_[side], CV_16SC2);
    real_sizes_[side] = {real.width, real.height};
  }
  seen_ = cv::Mat::zeros(camera_.height, camera_.width, CV_8UC1);
  for (int y = 0; y < camera_.height; ++y)
    for (int x = 0; x < camera_.width; ++x) {
      const auto pixel = real_pixel(camera_, x, y, rig.cameras[0], R_left_virtual);
      seen_.at<std::uint8_t>(y, x) = pixel ? 255 : 0;
      left_pixel_.push_back(pixel ? static_cast<std::int32_t>(std::lround(pixel->y())) *
                                            rig.cameras[0].width +
                                        static_cast<std::int32_t>(std::lround(pixel->x()))
                                  : kOutside);
    }
}

cv::Mat StereoRectification::rectified(const GrayImage& image, int side) const {
  const auto index = static_cast<std::size_t>(side);
  CV_Assert(cv::Size(image.width, image.height) == real_sizes_[index]);
  cv::Mat full;
  cv::remap(header(image), full, maps_[index], map_fractions_[index], cv::INTER_LINEAR,
            cv::BORDER_CONSTANT);
  if (full.size() == seen_.size()) return full;
  cv::Mat small;
  const int factor = full.cols / camera_.width;
  cv::resize(full(cv::Rect(0, 0, camera_.width * factor, camera_.height * factor)), small,
             seen_.size(), 0.0, 0.0, cv::INTER_AREA);
  return small;
}

LabelImage StereoRectification::rectified(const LabelImage& labels) const {
  CV_Assert(cv::Size(labels.width, labels.height) == real_sizes_[0]);
  LabelImage result{camera_.width, camera_.height, {}};
  result.ids.reserve(left_pixel_.size());
  for (const std::int32_t index : left_pixel_)
    result.ids.push_back(index == kOutside ? LabelId{0}
                                           : labels.ids[static_cast<std::size_t>(index)]);
  return result;
}

}  // namespace km
