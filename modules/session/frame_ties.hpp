#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/session/team_messages.hpp"

namespace km {

/// A tie of two robots: closures between them that are not rejected, or one datum in which both are
/// located. `places` is the number of rows of these closures, see find_rows(), or of their places
/// if no closure between the robots is rejected. A datum counts as two.
struct RobotTie {
  RobotId a = 0;  ///< a < b.
  RobotId b = 0;
  std::uint32_t places = 0;   ///< At least 1.
  bool contradicted = false;  ///< See EdgeSetOffer.
  auto operator<=>(const RobotTie&) const = default;
};

/// The ties between all robots of `statuses` (by robot), ascending. Both robots of a pair report
/// these numbers in their statuses. While the two numbers differ, the lower one counts. With
/// `solved`, the plan of the last session with a solution: a pair of its members that has found its
/// first closures since is not tied. The solution lacks these closures and may place the two robots
/// anywhere, until the next session.
[[nodiscard]] std::vector<RobotTie> find_ties(const std::map<RobotId, TeamStatus>& statuses,
                                              const SessionPlan* solved = nullptr);

/// Robots whose pose relative to one robot is not certain.
struct FrameTies {
  /// Only a tie of a single row connects these robots to the one robot. All closures of a row
  /// may be false together; then the relative pose is wrong.
  std::vector<RobotId> tentative = {};
  /// No tie connects these robots to the one robot, or only a contradicted tie. Their pose relative
  /// to the one robot is unknown.
  std::vector<RobotId> not_joined = {};
  bool operator==(const FrameTies&) const = default;
};

/// Classifies `members` (ascending) relative to the robot `self`. A tie of one row is certain if
/// other ties connect its two robots, too, because closures that contradict each other along a loop
/// of robots are rejected. A contradicted tie of several rows ties nothing: in a hall of equal
/// aisles, false closures may agree along such a loop, too. The cost is O(ties^2) if each robot has
/// one row.
[[nodiscard]] FrameTies frame_ties(RobotId self, std::span<const RobotId> members,
                                   std::span<const RobotTie> ties);

/// The lowest robot of `plan` that is not in `ties.not_joined`; `self` itself if there is no lower
/// one.
[[nodiscard]] RobotId lowest_tied(RobotId self, const SessionPlan& plan, const FrameTies& ties);

}  // namespace km
