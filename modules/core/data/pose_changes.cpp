#include "modules/core/data/pose_changes.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace km {
namespace {

using Pose = PoseChanges::Pose;

bool has_moved(const SE3& stated, const SE3& now) {
  static const double kMinCosine = std::cos(StatedPoses::kMaxTurn_rad);
  const double cosine = 0.5 * ((stated.linear().transpose() * now.linear()).trace() - 1.0);
  return (stated.translation() - now.translation()).norm() > StatedPoses::kMaxShift_m ||
         cosine < kMinCosine;
}

bool has_changed(const Pose& stated, const Pose& now) {
  if (has_moved(stated.T_world_kf, now.T_world_kf)) return true;
  if (!now.covariance || !stated.covariance) return now.covariance && !stated.covariance;
  const double before = stated.covariance->trace();
  return std::abs(now.covariance->trace() - before) > StatedPoses::kMaxVarianceChange * before;
}

std::vector<Pose> poses_of(const Trajectory& trajectory) {
  std::vector<Pose> poses;
  for (std::size_t k = 0; k < trajectory.T_world_kf.size(); ++k) {
    Pose& pose = poses.emplace_back();
    pose.id = {trajectory.robot, static_cast<KeyframeIndex>(k)};
    pose.T_world_kf = trajectory.T_world_kf[k];
    if (k < trajectory.covariances.size()) pose.covariance = trajectory.covariances[k];
  }
  for (const auto& [id, T] : trajectory.public_poses) poses.push_back({id, T, {}});
  return poses;
}

}  // namespace

std::optional<PoseChanges> StatedPoses::update(const Trajectory& trajectory) {
  std::vector<Pose> poses = poses_of(trajectory);
  const auto is_finite = [](const Pose& pose) {
    return pose.T_world_kf.matrix().allFinite() &&
           (!pose.covariance || pose.covariance->allFinite());
  };
  if (!std::ranges::all_of(poses, is_finite)) return std::nullopt;
  if (std::exchange(anchor_, trajectory.anchor) != trajectory.anchor) stated_.clear();
  std::erase_if(poses, [&](const Pose& pose) {
    const auto [stated, is_new] = stated_.try_emplace(pose.id, pose);
    if (!is_new && !has_changed(stated->second, pose)) return true;
    stated->second = pose;
    return false;
  });
  if (poses.empty()) return std::nullopt;
  return PoseChanges{trajectory.anchor, std::move(poses)};
}

}  // namespace km
