#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/pose_graph/team_messages.hpp"

namespace km {

/// Two robots and the number of places at which closures tie them (see find_places()). Rejected
/// closures do not count.
struct RobotTie {
  RobotId a = 0;  ///< a < b.
  RobotId b = 0;
  std::uint32_t places = 0;  ///< At least 1.
  bool contested = false;    ///< One place, and another one that is as likely contradicts it.
  auto operator<=>(const RobotTie&) const = default;
};

/// The ties between all robots of `statuses` (by robot), ascending. The robots of a pair decide on
/// their closures together; until both have reported it, the lower number of places counts.
[[nodiscard]] std::vector<RobotTie> find_ties(const std::map<RobotId, TeamStatus>& statuses);

/// Robots whose place relative to one robot is not certain.
struct FrameTies {
  /// A single place ties these robots: if it only looks like another place, they are elsewhere.
  std::vector<RobotId> tentative = {};
  /// No closure ties these robots, or closures at two places that contradict each other: nothing is
  /// known about their place.
  std::vector<RobotId> untied = {};
  bool operator==(const FrameTies&) const = default;
};

/// Classifies `members` (ascending) relative to the robot `self`. A tie of one place is certain if
/// other ties connect its two robots, too: closures that contradict each other along a circle of
/// robots are rejected. O(ties^2) for robots with one place each.
[[nodiscard]] FrameTies frame_ties(RobotId self, std::span<const RobotId> members,
                                   std::span<const RobotTie> ties);

/// The lowest robot of `plan` that closures tie to `self`; `self` itself if there is no lower one.
[[nodiscard]] RobotId lowest_tied(RobotId self, const SessionPlan& plan, const FrameTies& ties);

}  // namespace km
