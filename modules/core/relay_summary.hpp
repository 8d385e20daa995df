#pragma once

#include <cstdint>
#include <vector>

#include "modules/core/robot_identity.hpp"

namespace km {

/// Number of messages of one robot that another robot holds without a gap, from the first on.
struct RelayHeld {
  TeamPeer origin;
  std::uint32_t bags = 0;      ///< 0 for an origin that is received directly.
  std::uint32_t reliable = 0;  ///< Number of reliable messages, see RelayStore.

  bool operator==(const RelayHeld&) const = default;
};

/// State of the relay of a robot, as the robot publishes it, ascending by robot. `holds` is empty
/// if all robots receive each other directly all the time.
struct RelaySummary {
  std::vector<RobotId> received;  ///< Robots that are received directly.
  /// One for each known robot that is not received directly, or whose reliable messages are held.
  std::vector<RelayHeld> holds = {};

  bool operator==(const RelaySummary&) const = default;
};

}  // namespace km
