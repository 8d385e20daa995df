#include "modules/core/data/team_links.hpp"

#include <utility>

namespace km {

bool TeamLinks::report(RobotId robot, std::set<RobotId> received) {
  const auto [known, is_new] = received_by_.try_emplace(robot);
  if (!is_new && known->second == received) return false;
  known->second = std::move(received);
  return true;
}

bool TeamLinks::receives(RobotId a, RobotId b) const {
  const auto known = received_by_.find(a);
  return known != received_by_.end() && known->second.contains(b);
}

std::vector<RobotId> TeamLinks::neighbours(RobotId robot) const {
  std::vector<RobotId> neighbours;
  const auto known = received_by_.find(robot);
  if (known == received_by_.end()) return neighbours;
  for (const RobotId other : known->second)
    if (other != robot && receives(other, robot)) neighbours.push_back(other);
  return neighbours;
}

std::map<RobotId, std::size_t> TeamLinks::distances(RobotId robot) const {
  std::map<RobotId, std::size_t> distances{{robot, 0}};
  std::vector<RobotId> frontier{robot};
  for (std::size_t distance = 1; !frontier.empty(); ++distance) {  // breadth first
    std::vector<RobotId> next;
    for (const RobotId reached : frontier)
      for (const RobotId neighbour : neighbours(reached))
        if (distances.try_emplace(neighbour, distance).second) next.push_back(neighbour);
    frontier = std::move(next);
  }
  return distances;
}

std::set<RobotId> TeamLinks::component(RobotId self) const {
  std::set<RobotId> component;
  for (const auto& [robot, distance] : distances(self)) component.insert(robot);
  return component;
}

}  // namespace km
