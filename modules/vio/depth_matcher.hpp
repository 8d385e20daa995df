#pragma once

#include <optional>
#include <span>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/vio/stereo_matcher.hpp"
#include "modules/vio/tracker_config.hpp"

namespace km {

/// What StereoMatcher finds in a right image, read from a depth image instead: where the virtual
/// right camera of an RGB-D rig would see the points. Not thread-safe.
///
/// The right bearing is a function of the left one and the depth, so that an error of the left one
/// is in both, where stereo has two errors of their own. The smoother takes them for independent,
/// as ORB-SLAM2 does: it trusts the row of a point like stereo does, with two observations of it.
class DepthMatcher {
 public:
  /// Precondition: rig.depth_source is kDepthImage.
  DepthMatcher(const StereoRig& rig, const TrackerConfig& config);

  /// One entry for each query; its expected depth is not used. Without an image none is found.
  /// Nearer than TrackerConfig::min_depth_m counts as no depth. Precondition: `depth` fits the rig.
  [[nodiscard]] std::vector<std::optional<StereoMatch>> match(const DepthImage* depth,
                                                              std::span<const StereoQuery> queries);

  /// Of the last match(): `no_start` counts points without a depth, or on an edge between two.
  [[nodiscard]] const StereoStatistics& statistics() const { return statistics_; }

 private:
  SE3 T_right_left_;
  double max_inverse_depth_;
  double edge_;
  StereoStatistics statistics_;
};

}  // namespace km
