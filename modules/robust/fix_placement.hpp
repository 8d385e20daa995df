#pragma once

#include <span>
#include <vector>

#include "modules/core/data/position_fix.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/tree_newton/pose_edge.hpp"

namespace km {

/// The absolute frame of position fixes relative to the poses of a robot.
struct FixPlacement {
  SE3 T_frame_datum = SE3::Identity();
  std::vector<bool> kept;  ///< Fix k agrees with odometry and with most other fixes.
  FixesState state;
};

/// Places the absolute frame so that most fixes agree with the poses, and decides which fixes are
/// true. Deterministic; O(n) in the number of fixes.
///
/// 1. Random pairs of fixes (triples unless `upright`) give hypotheses of the frame. Their cost is
///    the sum of truncated squared distances.
/// 2. Odometry drifts, so that one transform does not fit all fixes of a long run. The offset of
///    the fixes to the poses is a random walk along the fixes, with the variance of odometry.
///    Graduated non-convexity weighs the fixes on it (see robust_weight()). A block of consecutive
///    fixes with a common error is rejected, because odometry does not jump to the block and back.
/// 3. The least-squares transform of the kept fixes.
///
/// The frame is `located` if at least five fixes are kept, more than half of all, and if the
/// standard deviation of the rotation is at most 0.1 rad. Fixes with correlated errors count
/// less, and more than ten independent ones count as ten. A robot that stands still is not located,
/// however many fixes it has. `upright`: z of poses and fixes is up, and only the heading is
/// unknown. `step` has the weights of one step of odometry. Precondition: there is a fix.
[[nodiscard]] FixPlacement place_fixes(std::span<const PositionFix> fixes,
                                       std::span<const SE3> T_frame_kf, const Precision& step,
                                       bool upright);

/// The kept fixes as edges from keyframe 0, whose frame is the absolute one. Such an edge measures
/// the position of a keyframe. Its weight is 1 / sigma^2 over the sum of the correlations of its
/// error with those of the kept fixes, so that a common error of near fixes counts once. The lever
/// arm p_kf turns with the rotation of the keyframe in `T_frame_kf`. A rotation by d in the session
/// therefore makes an error of d |p_kf|.
[[nodiscard]] std::vector<PoseEdge> fix_edges(std::span<const PositionFix> fixes,
                                              const std::vector<bool>& kept,
                                              std::span<const SE3> T_frame_kf);

}  // namespace km
