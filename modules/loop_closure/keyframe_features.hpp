#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/data/keyframe.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/loop_closure/epipolar_matcher.hpp"
#include "modules/loop_closure/keyframe_features_config.hpp"
#include "modules/loop_closure/keypoint_describer.hpp"

namespace km {

/// Extracts the features of a frame for place recognition and verification: evenly spread ORB
/// keypoints of the left image, the strongest first (Rublee et al., "ORB: an efficient alternative
/// to SIFT or SURF", ICCV 2011). Keypoints have a depth if the right image or the depth image
/// yields one. With a KeypointDescriber its descriptors are those by which keyframes are matched.
/// Not thread-safe.
class KeyframeFeatureExtractor {
 public:
  /// Throws ConfigError if `config` is out of bounds, std::invalid_argument if the rig cannot be
  /// rectified.
  KeyframeFeatureExtractor(const StereoRig& rig, const KeyframeFeaturesConfig& config,
                           std::optional<KeypointDescriber> describer = {});

  /// Features of `frame`, at most max_keypoints. An image without corners gives none. Throws
  /// std::invalid_argument if the frame does not fit the rig (see fits()).
  [[nodiscard]] KeyframeFeatures extract(const StereoFrame& frame);

 private:
  [[nodiscard]] std::vector<float> inverse_depths(const StereoFrame& frame,
                                                  std::span<const Eigen::Vector2f> pixels,
                                                  std::span<const Eigen::Vector2f> bearings) const;

  KeyframeFeaturesConfig config_;
  StereoRig rig_;
  std::optional<EpipolarMatcher> stereo_;  // absent with an RGB-D rig
  std::optional<KeypointDescriber> describer_;
};

/// Moves the keypoints of a rolling shutter to where they are at the stamp of the image, the
/// exposure of its middle row. `camera`: the left camera; `readout_s`: time from the first to the
/// last row; `twist_body`: [rotation; translation] of the body in its frame [rad/s; m/s].
///
/// The camera has the angular rate w and the velocity v. A point that stands still has the bearing
/// b on z = 1 and the inverse depth rho. They change by db/dt = u - u_z b and drho/dt = -u_z rho,
/// with u = -w x b - rho v. See Longuet-Higgins and Prazdny, "The Interpretation of a Moving
/// Retinal Image", Proc. R. Soc. B 1980. A keypoint without depth counts as infinitely far.
void unroll(const Camera& camera, double readout_s, const Vector6& twist_body,
            KeyframeFeatures& features);

/// The keypoints of `features` at `places`, in their order.
[[nodiscard]] KeyframeFeatures selected(const KeyframeFeatures& features,
                                        std::span<const std::size_t> places);

/// At most `count` keypoints: first those with a known depth, each group in the order of
/// `features`.
[[nodiscard]] KeyframeFeatures reduced(const KeyframeFeatures& features, std::size_t count);

}  // namespace km
