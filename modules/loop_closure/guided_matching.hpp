#pragma once

#include <vector>

#include "modules/loop_closure/matching.hpp"
#include "modules/loop_closure/relative_pose.hpp"

namespace km {

/// Where and how alike a match must be once the pose is roughly known.
struct GuidedMatchRules {
  double radius_px = 8.0;  ///< Around the projection, at the finest level.
  double max_ratio = 0.9;  ///< Best distance over second best inside the radius.
  int max_distance = 64;   ///< [bit]
};

/// Matches under a known pose: every point with depth of one keyframe is projected into the other,
/// both ways, and compared with the descriptors near its projection whose depth does not
/// contradict it. Pairs that are each other's best, ascending in a.
[[nodiscard]] std::vector<Match> match_guided(const SE3& T_a_b, const KeyframeFeatures& a,
                                              const KeyframeFeatures& b,
                                              const GuidedMatchRules& rules);

}  // namespace km
