#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <vector>

#include "modules/core/ids.hpp"

namespace km {

/// Who hears whom in a team, as its robots tell it. A link counts if both of its ends say that they
/// hear the other one: robots that are told the same see the same graph. Not thread-safe.
class TeamLinks {
 public:
  /// `robot` hears `heard` and nobody else. True if that is news.
  bool tell(RobotId robot, std::set<RobotId> heard);
  /// What `robot` said about itself does not hold any more.
  void forget(RobotId robot) { heard_by_.erase(robot); }

  /// True if `a` says that it hears `b`.
  [[nodiscard]] bool hears(RobotId a, RobotId b) const;
  [[nodiscard]] bool linked(RobotId a, RobotId b) const { return hears(a, b) && hears(b, a); }
  /// Ascending.
  [[nodiscard]] std::vector<RobotId> neighbours(RobotId robot) const;

  /// Number of links to all robots that links lead to from `robot`; 0 for itself.
  [[nodiscard]] std::map<RobotId, std::size_t> distances(RobotId robot) const;
  /// All robots that links lead to from `self`, itself included.
  [[nodiscard]] std::set<RobotId> component(RobotId self) const;

 private:
  std::map<RobotId, std::set<RobotId>> heard_by_;
};

}  // namespace km
