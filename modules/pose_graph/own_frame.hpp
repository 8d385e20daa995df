#pragma once

#include <cstdint>
#include <optional>

#include "modules/core/geometry.hpp"
#include "modules/pose_graph/team_messages.hpp"
#include "modules/pose_graph/team_roster.hpp"

namespace km {

/// `world`, in which robots publish, in the frame of a solution: the odometry frame of `anchor`.
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
  /// nullopt before it is known in this frame.
  [[nodiscard]] const std::optional<World>& world() const { return world_; }

  /// The solution is in another frame from now on; `world` is unknown there.
  void enter(const TeamFrame& frame);
  void set_world(const std::optional<World>& world) { world_ = world; }

  /// `world` with this anchor, from the pose of its keyframe 0 that all robots have received: all
  /// have one frame to the last digit. If the solution is `upright`, `world` has z up: the optimum
  /// has a better estimate of the tilt of keyframe 0 than its own vertical. nullopt if the poses of
  /// the anchor are unknown or in another frame.
  [[nodiscard]] std::optional<World> world_of(RobotId anchor, const TeamRoster& roster,
                                              const SE3& T_odom_first, bool upright) const;

 private:
  TeamPeer self_;
  TeamFrame frame_;
  std::uint32_t version_ = 0;
  std::optional<World> world_;
};

}  // namespace km
