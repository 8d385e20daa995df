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
  /// `public_poses` has the poses of absent robots only, and `step_precision` the entry of this
  /// robot only. The other members of the session send theirs. The agent sets `start`, in the
  /// present frame of the robot, and `decided` and `noise`, which follow from earlier sessions.
  SessionGraph graph = {};
  TreePlace place = {};
  bool in_frame = false;  ///< `start` is already in the frame of the session.
  /// Closures may be false (pose_graph.robust with Newton's method). The trajectory is then not
  /// deformed to fit closures, and claimed precisions are limited.
  bool closures_may_be_false = true;
  std::vector<KeyframeIndex> public_keyframes = {};  ///< Ascending, 0 first.
};

/// The measurements of robot `self` in `session`, of which it is a member. `peers` are the robots
/// that it knows; closures to absent ones are tied to their received poses. nullopt if `graph` does
/// not have the edges() by which the plan of the session names the closures of a pair.
[[nodiscard]] std::optional<FrozenPart> freeze_part(const Session& session, RobotId self,
                                                    const OwnGraph& graph,
                                                    std::span<const RobotId> peers,
                                                    const PublicPoses& published);

}  // namespace km
