#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "modules/core/ids.hpp"

namespace km {

/// Largest number of robots in a team.
inline constexpr std::size_t kMaxTeam = 128;

/// Graph of the links in a team, from the reports of its robots. A link counts if both ends report
/// that they receive the other one. Robots with equal reports see the same graph. Not thread-safe.
class TeamLinks {
 public:
  /// Stores the report that `robot` receives exactly the robots `received`. True if it is a change.
  bool report(RobotId robot, std::set<RobotId> received);
  /// Removes the report of `robot`.
  void forget(RobotId robot) { received_by_.erase(robot); }

  /// True if `a` reports that it receives `b`.
  [[nodiscard]] bool receives(RobotId a, RobotId b) const;
  [[nodiscard]] bool linked(RobotId a, RobotId b) const { return receives(a, b) && receives(b, a); }
  /// Ascending robot ids.
  [[nodiscard]] std::vector<RobotId> neighbours(RobotId robot) const;

  /// Number of links to each robot that can be reached from `robot`; 0 for itself.
  [[nodiscard]] std::map<RobotId, std::size_t> distances(RobotId robot) const;
  /// All robots that can be reached from `self`, including itself.
  [[nodiscard]] std::set<RobotId> component(RobotId self) const;

 private:
  std::map<RobotId, std::set<RobotId>> received_by_;
};

/// The links of the team as one robot knows them at one time.
struct LinksReport {
  TeamLinks links;
  std::uint64_t version = 0;  ///< Grows with every change.
};

}  // namespace km
