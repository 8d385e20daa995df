#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"

namespace km {

/// A pose rounded to whole numbers. All robots therefore compute with the same pose, bit by bit.
/// Rounding moves it by up to 0.5 mm per axis and turns it by up to 0.06 mrad.
struct RoundedPose {
  std::array<std::int32_t, 3> t = {0, 0, 0};         ///< Position [mm].
  std::array<std::int16_t, 4> q = {0, 0, 0, 32767};  ///< Quaternion x y z w [1/32767], w >= 0.

  /// Throws std::invalid_argument for a position that is not finite or beyond 2147 km.
  [[nodiscard]] static RoundedPose of(const SE3& T);

  /// Precondition: is_valid().
  [[nodiscard]] SE3 pose() const;
  /// True if the quaternion has unit length within 1e-3.
  [[nodiscard]] bool is_valid() const;
  bool operator==(const RoundedPose&) const = default;
};

/// A keyframe that moves a mesh, and its pose in `world`.
struct MeshKeyframe {
  KeyframeIndex index = 0;
  RoundedPose T_world_kf;
  bool operator==(const MeshKeyframe&) const = default;
};

/// The pose of a keyframe in a list with ascending indices, if it is there.
[[nodiscard]] std::optional<SE3> find_pose(std::span<const MeshKeyframe> keyframes,
                                           KeyframeIndex index);

/// Bytes of a MeshKeyframe on the wire.
inline constexpr std::size_t kMeshKeyframeBytes = 24;

/// Largest number of keyframes of MeshPoses.
inline constexpr std::size_t kMaxMeshKeyframes = 1024;

/// Present poses of the keyframes that move the mesh of a robot: every mesh_keyframe_step()-th one.
/// The newest message of a robot counts. It moves all chunks that the robot has sent: see place().
struct MeshPoses {
  RobotId robot = 0;
  std::uint64_t boot = 0;  ///< Boot id of the sender; only set in received messages.
  RobotId anchor = 0;      ///< Robot whose odometry frame is `world`.
  std::vector<MeshKeyframe> keyframes = {};  ///< Ascending indices.

  bool operator==(const MeshPoses&) const = default;
};

/// Upper bound on the bytes of poses on the wire, with their envelope.
[[nodiscard]] inline std::size_t wire_bytes(const MeshPoses& poses) {
  constexpr std::size_t kFixed = 72;
  return kFixed + kMeshKeyframeBytes * poses.keyframes.size();
}

/// The reason why keyframes cannot be those of a mesh (a string literal), or null: indices ascend,
/// and rotations are valid.
[[nodiscard]] const char* fault_of(std::span<const MeshKeyframe> keyframes);

/// Distance [keyframes] between those keyframes of a trajectory that move a mesh. It is 4, and
/// doubles whenever the trajectory has more than 1024 of them.
[[nodiscard]] KeyframeIndex mesh_keyframe_step(std::size_t keyframes);

/// Every mesh_keyframe_step()-th keyframe of a trajectory. Throws as RoundedPose::of().
[[nodiscard]] std::vector<MeshKeyframe> mesh_keyframes(std::span<const SE3> T_world_kf);

/// True if receivers of `before` need `after`: it has another anchor or other keyframes, or it
/// moves some point within 5 m of a keyframe by more than `least_m`.
[[nodiscard]] bool has_moved(const MeshPoses& before, const MeshPoses& after, double least_m);

}  // namespace km
