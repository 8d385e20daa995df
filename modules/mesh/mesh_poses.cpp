#include "modules/mesh/mesh_poses.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace km {
namespace {

constexpr double kUnits_per_m = 1e3;
constexpr double kFarthest_mm = 2147e6;
constexpr double kQuaternionUnit = 1.0 / 32767.0;
constexpr double kQuaternionTolerance = 1e-3;
constexpr KeyframeIndex kFirstStep = 4;
constexpr double kReach_m = 5.0;  // typical range of depth

Eigen::Vector4d coefficients(const RoundedPose& pose) {
  return kQuaternionUnit * Eigen::Vector4d(pose.q[0], pose.q[1], pose.q[2], pose.q[3]);
}

double motion_m(const RoundedPose& before, const RoundedPose& after) {
  const SE3 a = before.pose(), b = after.pose();
  return (a.translation() - b.translation()).norm() +
         kReach_m * angle_of(a.linear() * b.linear().transpose());
}

}  // namespace

RoundedPose RoundedPose::of(const SE3& T) {
  RoundedPose rounded;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double mm = std::round(kUnits_per_m * T.translation()[static_cast<Eigen::Index>(axis)]);
    if (!(std::abs(mm) <= kFarthest_mm))
      throw std::invalid_argument("mesh poses: a keyframe is not finite or too far away");
    rounded.t[axis] = static_cast<std::int32_t>(mm);
  }
  Eigen::Vector4d unit = Eigen::Quaterniond(T.linear()).normalized().coeffs();
  if (unit.w() < 0.0) unit = -unit;
  for (std::size_t i = 0; i < 4; ++i)
    rounded.q[i] =
        static_cast<std::int16_t>(std::round(unit[static_cast<Eigen::Index>(i)] / kQuaternionUnit));
  return rounded;
}

SE3 RoundedPose::pose() const {
  const Eigen::Quaterniond rotation(coefficients(*this));
  return make_pose(rotation.normalized().toRotationMatrix(),
                   Eigen::Vector3d(t[0], t[1], t[2]) / kUnits_per_m);
}

bool RoundedPose::is_valid() const {
  return std::abs(coefficients(*this).norm() - 1.0) <= kQuaternionTolerance;
}

std::optional<SE3> find_pose(std::span<const MeshKeyframe> keyframes, KeyframeIndex index) {
  const auto found = std::ranges::lower_bound(keyframes, index, {}, &MeshKeyframe::index);
  if (found == keyframes.end() || found->index != index) return std::nullopt;
  return found->T_world_kf.pose();
}

const char* fault_of(std::span<const MeshKeyframe> keyframes) {
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    if (i > 0 && keyframes[i].index <= keyframes[i - 1].index) return "keyframes do not ascend";
    if (!keyframes[i].T_world_kf.is_valid()) return "a keyframe without a rotation";
  }
  return nullptr;
}

KeyframeIndex mesh_keyframe_step(std::size_t keyframes) {
  KeyframeIndex step = kFirstStep;
  while ((keyframes + step - 1) / step > kMaxMeshKeyframes) step *= 2;
  return step;
}

std::vector<MeshKeyframe> mesh_keyframes(std::span<const SE3> T_world_kf) {
  const KeyframeIndex step = mesh_keyframe_step(T_world_kf.size());
  std::vector<MeshKeyframe> keyframes;
  for (KeyframeIndex i = 0; i < T_world_kf.size(); i += step)
    keyframes.push_back({i, RoundedPose::of(T_world_kf[i])});
  return keyframes;
}

bool has_moved(const MeshPoses& before, const MeshPoses& after, double least_m) {
  if (before.anchor != after.anchor || before.keyframes.size() != after.keyframes.size())
    return true;
  for (std::size_t i = 0; i < after.keyframes.size(); ++i) {
    const MeshKeyframe &a = before.keyframes[i], &b = after.keyframes[i];
    if (a.index != b.index || motion_m(a.T_world_kf, b.T_world_kf) > least_m) return true;
  }
  return false;
}

}  // namespace km
