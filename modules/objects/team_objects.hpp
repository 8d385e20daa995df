#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <vector>

#include "modules/core/data/pose_graph.hpp"
#include "modules/objects/map_object.hpp"
#include "modules/objects/objects_config.hpp"

namespace km {

/// The message of a robot about its objects: the largest kMaxObjects surfaces, each relative to its
/// keyframe. Keyframes without an optimised pose are replaced by the last one that has a pose.
/// Precondition: `trajectory` has a pose.
[[nodiscard]] RobotObjects anchored(std::span<const MapObject> objects,
                                    const Trajectory& trajectory);

/// The keyframes that a message states with their odometry: of every ten consecutive keyframes, the
/// first one that an object has and that `odometry` has. If these are more than
/// kMaxObjectKeyframes, the newest ones.
[[nodiscard]] std::vector<SurfaceKeyframe> keyframes_of(
    const RobotObjects& objects, const std::map<KeyframeIndex, OdometryPose>& odometry);

/// True if the difference matters to another robot: another frame, number or class of objects, or a
/// side, centre or keyframe pose that has changed by more than `min_change_m`.
[[nodiscard]] bool differ(const RobotObjects& a, const RobotObjects& b, double min_change_m);

/// The objects of all robots, of which the newest message of each counts. Those of a robot that
/// leaves stay. When a robot restarts, its first message replaces its former objects. Not
/// thread-safe.
class TeamObjects {
 public:
  /// `own`: id of this robot, whose message add() also accepts.
  TeamObjects(RobotId own, const ObjectsConfig& config) : own_(own), config_(config) {}

  /// False for a message of an earlier incarnation, which is ignored.
  bool add(RobotObjects objects);

  /// All objects in the frame of `trajectory`, that of this robot, without copies. Own keyframes,
  /// and those of other robots with a public pose, have the poses of `trajectory`. Other keyframes
  /// have the poses that their robot sent. Objects of robots in another frame are left out.
  [[nodiscard]] ObjectList joint(const Trajectory& trajectory) const;

 private:
  struct Robot {
    RobotObjects newest;
    std::set<std::uint64_t> earlier_boots;
  };
  const RobotId own_;
  const ObjectsConfig config_;
  std::map<RobotId, Robot> robots_;
};

}  // namespace km
