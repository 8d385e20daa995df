#pragma once

#include <memory>

#include "modules/core/camera/color_image.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"

namespace km {

/// Depth, and labels if known, of every pixel of one camera at one instant, ready for a map. The
/// camera is the same for all frames of a robot, and may be a virtual one (see DenseSensor).
struct DenseFrame {
  Stamp stamp = 0;
  std::shared_ptr<const DepthImage> depth;  ///< Not null.
  /// Labels in the camera of `depth`; null if unknown.
  std::shared_ptr<const LabelImage> labels = nullptr;
  SE3 T_odom_cam = SE3::Identity();  ///< Pose in the frame of T_odom_kf.
  KeyframeIndex keyframe = 0;        ///< Last keyframe of the robot at that time.
  /// Colours in the camera of `depth`, grey ones of a grey image; null if unknown.
  std::shared_ptr<const ColorImage> color = nullptr;
};

}  // namespace km
