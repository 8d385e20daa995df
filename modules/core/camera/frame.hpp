#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "modules/core/camera/color_image.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// 8-bit grey image, row-major without padding: pixels.size() == width * height.
struct GrayImage {
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
  std::vector<std::uint8_t> pixels;
};

/// Distances along the optical axis of the left camera, pixel by pixel, with its size and its lens.
/// Row-major: millimetres.size() == width * height.
struct DepthImage {
  int width = 0;                           ///< [px]
  int height = 0;                          ///< [px]
  std::vector<std::uint16_t> millimetres;  ///< z [mm]; 0: none.
};

/// Semantic classes (LabelId, modules/core/map/label_palette.hpp) of the left image, pixel by
/// pixel. Row-major: ids.size() == width * height.
struct LabelImage {
  int width = 0;                  ///< [px]
  int height = 0;                 ///< [px]
  std::vector<std::uint8_t> ids;  ///< 0: unknown.
};

/// Images of a robot's cameras at one instant: a stereo pair, or, with an RGB-D rig (see
/// DepthSource), a left image with depth. Depth and labels may come at a lower rate than images.
struct StereoFrame {
  Stamp stamp = 0;
  GrayImage left;
  GrayImage right;                                     ///< 0 x 0 with an RGB-D rig.
  std::shared_ptr<const DepthImage> depth = nullptr;   ///< Null if there is none.
  std::shared_ptr<const LabelImage> labels = nullptr;  ///< Null if there are none.
  /// Decodes the colours of the left image; 0 x 0 for a grey image. Empty: grey.
  std::function<ColorImage()> decode_color = nullptr;
};

/// One inertial sample in the body frame.
struct ImuSample {
  Stamp stamp = 0;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();   ///< Angular rate [rad/s].
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();  ///< Specific force [m/s^2]: at rest, minus g.
};

/// Pose of the body from an external odometry, in the frame `odom` of that odometry.
struct MeasuredPose {
  SE3 T_odom_body = SE3::Identity();
  /// Covariance of a perturbation on the right; zero if unknown.
  Matrix6 covariance = Matrix6::Zero();
};

/// A frame and the inertial samples since the one before, in order of time. The last sample is the
/// first at or after the frame's stamp, so that the interval is covered. It is repeated as the
/// first sample of the next packet.
struct SensorPacket {
  std::shared_ptr<const StereoFrame> frame;
  std::vector<ImuSample> imu;
  std::optional<MeasuredPose> pose = {};  ///< Pose at the frame, if there is an external odometry.
};

}  // namespace km
