#include "modules/simulation/rendering/motion_blur.hpp"

#include <algorithm>
#include <cmath>

namespace km {
namespace {

// Velocities of the camera in its own frame.
struct CameraVelocity {
  Eigen::Vector3f angular;
  Eigen::Vector3f linear;
};

CameraVelocity camera_velocity(const SE3& T_body_cam, const Vector6& body_velocity) {
  const Eigen::Vector3d omega = body_velocity.head<3>();
  const Eigen::Vector3d at_camera = body_velocity.tail<3>() + omega.cross(T_body_cam.translation());
  const Eigen::Matrix3d R_cam_body = T_body_cam.linear().transpose();
  return {(R_cam_body * omega).cast<float>(), (R_cam_body * at_camera).cast<float>()};
}

template <typename Value>
Value bilinear(const std::vector<Value>& image, int width, int height, float x, float y) {
  x = std::clamp(x, 0.0F, static_cast<float>(width - 1));
  y = std::clamp(y, 0.0F, static_cast<float>(height - 1));
  const int column = std::min(static_cast<int>(x), std::max(width - 2, 0));
  const int row = std::min(static_cast<int>(y), std::max(height - 2, 0));
  const float fx = x - static_cast<float>(column);
  const float fy = y - static_cast<float>(row);
  const Value* p = image.data() + static_cast<std::ptrdiff_t>(row) * width + column;
  const std::ptrdiff_t right = width > 1 ? 1 : 0;
  const std::ptrdiff_t down = height > 1 ? width : 0;
  const Value low = p[0] + fx * (p[right] - p[0]);
  const Value high = p[down] + fx * (p[down + right] - p[down]);
  return low + fy * (high - low);
}

}  // namespace

std::vector<Eigen::Vector2f> image_motion(const PixelRays& rays, const std::vector<float>& depth_m,
                                          const Vector6& body_velocity, double time_s) {
  const PinholeCamera& camera = rays.camera();
  const auto [omega, v] = camera_velocity(camera.T_body_cam, body_velocity);
  const auto time = static_cast<float>(time_s);
  std::vector<Eigen::Vector2f> motion(depth_m.size());
  std::size_t i = 0;
  for (int y = 0; y < camera.height; ++y) {
    const Eigen::Vector2f* bearing =
        rays.bearings().data() + static_cast<std::ptrdiff_t>(y) * rays.stride();
    for (int x = 0; x < camera.width; ++x, ++i, ++bearing) {
      const Eigen::Vector2f& b = *bearing;
      const float inverse_depth = depth_m[i] > 0.0F ? 1.0F / depth_m[i] : 0.0F;
      // Motion of the point at unit depth, then of its bearing.
      const float px = -(omega.y() - omega.z() * b.y() + v.x() * inverse_depth);
      const float py = -(omega.z() * b.x() - omega.x() + v.y() * inverse_depth);
      const float pz = -(omega.x() * b.y() - omega.y() * b.x() + v.z() * inverse_depth);
      const float bx = px - b.x() * pz;
      const float by = py - b.y() * pz;
      // Pixels per bearing: the inverse of how the bearing changes from pixel to pixel.
      const Eigen::Vector2f right = bearing[1] - b;
      const Eigen::Vector2f down = bearing[rays.stride()] - b;
      const float scale = time / (right.x() * down.y() - right.y() * down.x());
      motion[i] = {scale * (down.y() * bx - down.x() * by),
                   scale * (right.x() * by - right.y() * bx)};
    }
  }
  return motion;
}

template <typename Value>
std::vector<Value> blurred(const std::vector<Value>& image, int width, int height,
                           const std::vector<Eigen::Vector2f>& motion) {
  std::vector<Value> result(image.size());
  std::size_t i = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++i) {
      constexpr float kStill_px = 0.2F;  // blurs less than the pixel itself does
      constexpr float kMostTaps = 64.0F;
      const float length = motion[i].norm();
      if (!(length > kStill_px)) {
        result[i] = image[i];
        continue;
      }
      const auto taps = static_cast<int>(std::min(std::ceil(length) + 1.0F, kMostTaps));
      const Eigen::Vector2f step = motion[i] / static_cast<float>(taps);
      const float first = -0.5F * static_cast<float>(taps - 1);
      Value sum = 0.0F * image[i];
      for (int k = 0; k < taps; ++k) {
        const float along = first + static_cast<float>(k);
        sum += bilinear(image, width, height, static_cast<float>(x) + along * step.x(),
                        static_cast<float>(y) + along * step.y());
      }
      result[i] = sum / static_cast<float>(taps);
    }
  }
  return result;
}

template std::vector<float> blurred(const std::vector<float>&, int, int,
                                    const std::vector<Eigen::Vector2f>&);
template std::vector<Eigen::Vector3f> blurred(const std::vector<Eigen::Vector3f>&, int, int,
                                              const std::vector<Eigen::Vector2f>&);

}  // namespace km
