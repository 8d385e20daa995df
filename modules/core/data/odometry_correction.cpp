#include "modules/core/data/odometry_correction.hpp"

#include <algorithm>

#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

struct Correction {
  Stamp stamp = 0;
  SE3 T_world_odom = SE3::Identity();
};

std::vector<Correction> corrections(std::span<const StampedPose> odometry,
                                    std::span<const StampedPose> keyframes) {
  std::vector<Correction> result;
  std::size_t k = 0;
  for (const StampedPose& pose : odometry) {
    while (k < keyframes.size() && keyframes[k].stamp < pose.stamp) ++k;
    if (k < keyframes.size() && keyframes[k].stamp == pose.stamp)
      result.push_back({pose.stamp, keyframes[k].T * pose.T.inverse()});
  }
  return result;
}

// Pose of the body under the corrections at both ends of an interval, blended by `share` in [0, 1].
// Blending the corrected poses instead of the corrections avoids the effect of lever arms.
SE3 blend(const Correction& from, const Correction& to, double share, const SE3& T_odom_body) {
  const SE3 a = from.T_world_odom * T_odom_body;
  const SE3 b = to.T_world_odom * T_odom_body;
  const Eigen::Vector3d turn = so3_log(a.linear().transpose() * b.linear());
  return make_pose(a.linear() * so3_exp(share * turn),
                   (1.0 - share) * a.translation() + share * b.translation());
}

}  // namespace

std::vector<StampedPose> correct_odometry(std::span<const StampedPose> odometry,
                                          std::span<const StampedPose> keyframes) {
  const std::vector<Correction> anchors = corrections(odometry, keyframes);
  std::vector<StampedPose> result(odometry.begin(), odometry.end());
  if (anchors.empty()) return result;
  std::size_t next = 0;  // first keyframe after the pose
  for (StampedPose& pose : result) {
    while (next < anchors.size() && anchors[next].stamp <= pose.stamp) ++next;
    const Correction& after = anchors[std::min(next, anchors.size() - 1)];
    const Correction& before = anchors[next == 0 ? 0 : next - 1];
    const double interval_s = seconds_between(before.stamp, after.stamp);
    const double share =
        interval_s > 0.0 ? seconds_between(before.stamp, pose.stamp) / interval_s : 0.0;
    pose.T = blend(before, after, share, pose.T);
  }
  return result;
}

}  // namespace km
