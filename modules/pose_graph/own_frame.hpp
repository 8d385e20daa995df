#pragma once

#include <cstdint>
#include <optional>

#include "modules/core/geometry.hpp"
#include "modules/pose_graph/team_messages.hpp"
#include "modules/pose_graph/team_roster.hpp"

namespace km {

/// Pose of `world`, the frame in which robots publish, in the frame of a solution. `world` is the
/// odometry frame of `anchor`.
struct World {
  RobotId anchor = 0;
  SE3 T_frame_world = SE3::Identity();
};

/// The frame of the present solution of one robot, and `world` in it. Not thread-safe.
class OwnFrame {
 public:
  explicit OwnFrame(TeamPeer self) : self_(self), frame_(self) {}

  [[nodiscard]] const TeamFrame& frame() const { return frame_; }
  /// Counts the changes of the frame.
  [[nodiscard]] std::uint32_t version() const { return version_; }
  /// nullopt before `world` is known in this frame.
  [[nodiscard]] const std::optional<World>& world() const { return world_; }

  /// To be called when the solution is in `frame`. If that is another frame, `world` is unknown
  /// afterwards.
  void enter(const TeamFrame& frame);
  void set_world(const std::optional<World>& world) { world_ = world; }

  /// `world` with this anchor. It follows from the pose of keyframe 0 that the anchor has sent to
  /// all robots, so all compute the same `world` to the last bit. If the solution is `upright`,
  /// `world` is rotated so that z is up, because the optimum has a better estimate of the tilt of
  /// keyframe 0 than its own vertical. nullopt if the poses of the anchor are unknown or in another
  /// frame.
  [[nodiscard]] std::optional<World> world_of(RobotId anchor, const TeamRoster& roster,
                                              const SE3& T_odom_first, bool upright) const;

 private:
  TeamPeer self_;
  TeamFrame frame_;
  std::uint32_t version_ = 0;
  std::optional<World> world_;
};

}  // namespace km
