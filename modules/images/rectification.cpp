#include "modules/images/rectification.hpp"

#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

#include "modules/core/camera/depth_lookup.hpp"
#include "modules/images/image_view.hpp"

namespace km {
namespace {

void require_usable(const StereoRig& rig) {
  if (rig.depth_source != DepthSource::kRightImage)
    throw std::invalid_argument("rectification: the rig has no right camera");
  for (const Camera& camera : rig.cameras)
    if (camera.width <= 0 || camera.height <= 0 || !(camera.fx > 0.0) || !(camera.fy > 0.0))
      throw std::invalid_argument("rectification: a camera without pixels or focal length");
}

// Axes of the virtual cameras in the left camera: x along the baseline, and z as near as possible
// to the middle between the two real optical axes.
Eigen::Matrix3d rectified_axes(const StereoRig& rig) {
  constexpr double kMinAlignment = 0.87;  // cosine of 30 degrees
  const SE3 T_left_right = rig.T_left_right();
  const Eigen::Vector3d x = T_left_right.translation().normalized();
  const Eigen::Vector3d z_right = T_left_right.linear().col(2);
  if (!(z_right.z() > kMinAlignment) || !(x.x() > kMinAlignment))
    throw std::invalid_argument(
        "rectification: the right camera must have the direction of the left one and be to its "
        "right; kimera_multi_doctor finds poses that are inverted, and exchanged images");
  const Eigen::Vector3d y = (Eigen::Vector3d::UnitZ() + z_right).cross(x).normalized();
  Eigen::Matrix3d R_left_rect;
  R_left_rect << x, y, x.cross(y);
  return R_left_rect;
}

Camera virtual_camera(const Camera& left, const Eigen::Matrix3d& R_left_rect,
                      Rectification::Centre centre) {
  Camera camera;
  camera.width = left.width;
  camera.height = left.height;
  camera.fx = camera.fy = 0.5 * (left.fx + left.fy);
  if (centre == Rectification::Centre::kImage) {
    camera.cx = 0.5 * (left.width - 1);
    camera.cy = 0.5 * (left.height - 1);
  } else {
    const Eigen::Vector3d axis = R_left_rect.transpose() * Eigen::Vector3d::UnitZ();
    camera.cx = left.cx - camera.fx * axis.x() / axis.z();
    camera.cy = left.cy - camera.fy * axis.y() / axis.z();
  }
  camera.T_body_cam = left.T_body_cam * make_pose(R_left_rect, Eigen::Vector3d::Zero());
  return camera;
}

}  // namespace

std::optional<Eigen::Vector2d> seen_pixel(const Camera& camera, const Eigen::Vector3d& ray) {
  const auto pixel = camera.project_ray(ray);
  if (!pixel || !(pixel->x() >= 0.0 && pixel->x() <= camera.width - 1.0 && pixel->y() >= 0.0 &&
                  pixel->y() <= camera.height - 1.0))
    return std::nullopt;
  return pixel;
}

Rectification::Rectification(const StereoRig& rig, Centre centre) : real_(rig.cameras) {
  require_usable(rig);
  R_left_rect_ = rectified_axes(rig);
  camera_ = virtual_camera(real_[0], R_left_rect_, centre);
  const Eigen::Matrix3d R_right_left = rig.T_left_right().linear().transpose();
  for (std::size_t side = 0; side < 2; ++side) {
    const Eigen::Matrix3d R_real_rect = side == 0 ? R_left_rect_ : R_right_left * R_left_rect_;
    cv::Mat map(camera_.height, camera_.width, CV_32FC2);
    for (int y = 0; y < camera_.height; ++y)
      for (int x = 0; x < camera_.width; ++x) {
        const Eigen::Vector3d ray((x - camera_.cx) / camera_.fx, (y - camera_.cy) / camera_.fy,
                                  1.0);
        const auto pixel = seen_pixel(real_[side], R_real_rect * ray);
        map.at<cv::Vec2f>(y, x) =
            pixel ? cv::Vec2f(static_cast<float>(pixel->x()), static_cast<float>(pixel->y()))
                  : cv::Vec2f(-2.0F, -2.0F);  // outside the image, where remap() gives 0
      }
    cv::convertMaps(map, cv::noArray(), maps_[side], map_fractions_[side], CV_16SC2);
  }
}

cv::Mat Rectification::rectified(const GrayImage& image, std::size_t side) const {
  const Camera& real = real_.at(side);
  if (!fits(image, real))
    throw std::invalid_argument("rectification: image of " + std::to_string(image.width) + 'x' +
                                std::to_string(image.height) + ", expected " +
                                std::to_string(real.width) + 'x' + std::to_string(real.height));
  cv::Mat result;
  cv::remap(view(image), result, maps_[side], map_fractions_[side], cv::INTER_LINEAR,
            cv::BORDER_CONSTANT);
  return result;
}

}  // namespace km
