#pragma once

#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/images/rectification.hpp"
#include "modules/loop_closure/keyframe_features_config.hpp"

namespace km {

/// Depth of single points of the left image by stereo matching.
///
/// Both images are resampled so that epipolar lines become rows and equal focal lengths make the
/// disparity f * baseline / z. A patch is searched along its row by the sum of absolute
/// differences. The minimum is compared with the second best, and with the search from right to
/// left. Lucas-Kanade steps in disparity, row, gain and offset then refine the disparity to a
/// fraction of a pixel. Const members are safe to call from several threads.
class EpipolarMatcher {
 public:
  /// Throws ConfigError if `config` is out of bounds, std::invalid_argument for a rig that
  /// Rectification refuses.
  EpipolarMatcher(const StereoRig& rig, const KeyframeFeaturesConfig& config);

  /// Inverse depth [1/m] along the optical axis of the left camera for each bearing of the left
  /// camera (undistorted, z = 1); 0 where there is none. Throws std::invalid_argument if an image
  /// is not of the camera's size.
  [[nodiscard]] std::vector<float> inverse_depths(const StereoFrame& frame,
                                                  std::span<const Eigen::Vector2f> bearings) const;

 private:
  struct Rectified {
    cv::Mat left, right;            // resampled
    cv::Mat left_flat, right_flat;  // resampled, local mean subtracted
  };

  [[nodiscard]] Rectified rectify(const StereoFrame& frame) const;
  [[nodiscard]] float disparity(const Rectified& images, const Eigen::Vector2d& pixel) const;

  KeyframeFeaturesConfig config_;
  Rectification rectification_;
  double focal_baseline_;  // focal length times baseline [px m]
};

}  // namespace km
