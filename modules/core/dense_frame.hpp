#pragma once

#include <memory>

#include "modules/core/frame.hpp"
#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"

namespace km {

/// Depth, and labels where known, of every pixel of one camera at one instant, ready for a map. The
/// camera is fixed for a robot, and not always one that took images (see DenseSensor).
struct DenseFrame {
  Stamp stamp = 0;
  std::shared_ptr<const DepthImage> depth;             ///< Not null.
  std::shared_ptr<const LabelImage> labels = nullptr;  ///< Of the same camera. Null: none.
  SE3 T_odom_cam = SE3::Identity();                    ///< In the frame of T_odom_kf.
  KeyframeIndex keyframe = 0;                          ///< The robot's last one by then.
};

}  // namespace km
