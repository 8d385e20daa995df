#pragma once

#include <map>
#include <optional>
#include <vector>

#include "modules/core/data/pose_graph.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"

namespace km {

/// Optimised poses that have changed: of the keyframes of one robot, and the public poses of others
/// that the robot holds. If the anchor differs from that of the changes before, all poses stated
/// before are void.
struct PoseChanges {
  struct Pose {
    KeyframeId id;
    SE3 T_world_kf = SE3::Identity();
    std::optional<Matrix6> covariance = {};  ///< As in Trajectory.
  };
  RobotId anchor = 0;  ///< Robot whose odometry frame is `world`.
  std::vector<Pose> poses = {};
};

/// Turns the trajectories of one robot into changes. A pose is stated again when it has moved since
/// it was stated last by more than kMaxShift_m or kMaxTurn_rad. It is also stated again when its
/// variance has changed by more than kMaxVarianceChange. So all stated poses are within these
/// bounds.
class StatedPoses {
 public:
  static constexpr double kMaxShift_m = 0.01;
  static constexpr double kMaxTurn_rad = 0.5 / kDegrees;
  static constexpr double kMaxVarianceChange = 0.25;  ///< Share of the stated trace.

  /// The changes up to `trajectory`, ascending by keyframe. nullopt if there are none, or if a pose
  /// is not finite.
  [[nodiscard]] std::optional<PoseChanges> update(const Trajectory& trajectory);

 private:
  RobotId anchor_ = 0;
  std::map<KeyframeId, PoseChanges::Pose> stated_;
};

}  // namespace km
