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

/// Part of a robot in the relay, as it publishes it, ascending by robot. If all robots receive each
/// other directly, `holds` is empty.
struct RelaySummary {
  std::vector<RobotId> received;  ///< Robots that are received directly.
  /// For each known robot that is not received directly, or whose other messages are held.
  std::vector<RelayHeld> holds = {};

  bool operator==(const RelaySummary&) const = default;
};

}  // namespace km
