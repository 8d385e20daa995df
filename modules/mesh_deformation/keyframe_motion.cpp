#include "modules/mesh_deformation/keyframe_motion.hpp"

#include <algorithm>
#include <cstddef>

#include "modules/core/lie.hpp"

namespace km {
namespace {

// Distance between two poses of one keyframe, in units of the scale.
double distance(const SE3& a, const SE3& b, const MotionScale& scale) {
  return std::max((a.translation() - b.translation()).norm() / scale.translation_m,
                  angle_of(a.linear() * b.linear().transpose()) / scale.rotation_rad);
}

SE3 common_motion(std::span<const SE3> before, std::span<const SE3> after,
                  const MotionScale& scale) {
  Eigen::Vector3d mean_before = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_after = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < before.size(); ++i) {
    mean_before += before[i].translation();
    mean_after += after[i].translation();
  }
  mean_before /= static_cast<double>(before.size());
  mean_after /= static_cast<double>(before.size());
  // A small angle is the chordal distance over sqrt(2), so it has half the weight of a squared
  // translation.
  const double translation_weight = 1.0 / (scale.translation_m * scale.translation_m);
  const double rotation_weight = 0.5 / (scale.rotation_rad * scale.rotation_rad);
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < before.size(); ++i) {
    M += translation_weight * (after[i].translation() - mean_after) *
         (before[i].translation() - mean_before).transpose();
    M += rotation_weight * after[i].linear() * before[i].linear().transpose();
  }
  const Eigen::Matrix3d R = nearest_rotation(M);
  return make_pose(R, mean_after - R * mean_before);
}

}  // namespace

std::vector<SE3> complete(std::span<const SE3> T_odom_kf, std::span<const SE3> T_world_kf) {
  std::vector<SE3> result(T_world_kf.begin(), T_world_kf.end());
  if (T_odom_kf.empty()) return result;
  const std::size_t last = T_world_kf.size() - 1;
  const SE3 T_world_odom = T_world_kf[last] * T_odom_kf[last].inverse();
  for (std::size_t i = T_world_kf.size(); i < T_odom_kf.size(); ++i)
    result.push_back(T_world_odom * T_odom_kf[i]);
  return result;
}

KeyframeMotion keyframe_motion(std::span<const SE3> before, std::span<const SE3> after,
                               const MotionScale& scale) {
  const std::size_t count = std::min(before.size(), after.size());
  KeyframeMotion motion;
  if (count == 0) return motion;
  before = before.first(count);
  after = after.first(count);
  motion.T_after_before = common_motion(before, after, scale);
  for (std::size_t i = 0; i < count; ++i)
    motion.non_rigid =
        std::max(motion.non_rigid, distance(motion.T_after_before * before[i], after[i], scale));
  return motion;
}

double largest_difference(std::span<const SE3> poses, const SE3& T_a, const SE3& T_b,
                          const MotionScale& scale) {
  double largest = 0.0;
  for (const SE3& pose : poses)
    largest = std::max(largest, distance(T_a * pose, T_b * pose, scale));
  return largest;
}

}  // namespace km
