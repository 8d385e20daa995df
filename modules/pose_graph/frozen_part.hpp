#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "modules/pose_graph/own_graph.hpp"
#include "modules/pose_graph/session_graph.hpp"
#include "modules/pose_graph/team_messages.hpp"

namespace km {

/// The contribution of a robot to a session, frozen when it joins.
struct FrozenPart {
  /// `public_poses` has the poses of absent robots, and `step_precision` has the entry of this
  /// robot. The agent supplies `start`, in the present frame of the robot, and what it has decided.
  /// The members supply the rest.
  SessionGraph graph = {};
  TreePlace place = {};
  bool in_frame = false;  ///< `start` is already in the frame of the session.
  /// False closures are likely. The trajectory is then not deformed to fit closures.
  bool suspicious = true;
  std::vector<KeyframeIndex> public_keyframes = {};  ///< Ascending, 0 first.
};

/// The measurements of robot `self` in `session`, of which it is a member. `peers` are the robots
/// that it knows; closures to absent ones are tied to their received poses. nullopt if `self` does
/// not hold an edge set of the session.
[[nodiscard]] std::optional<FrozenPart> freeze_part(const Session& session, RobotId self,
                                                    const OwnGraph& graph,
                                                    std::span<const RobotId> peers,
                                                    const PublicPoses& published);

}  // namespace km
