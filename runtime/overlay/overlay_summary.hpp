#pragma once

#include <cstdint>
#include <vector>

#include "modules/core/robot_identity.hpp"

namespace km {

/// Number of messages of one robot that another robot holds without a gap, from the first on.
struct OverlayHeld {
  TeamPeer origin;
  std::uint32_t bags = 0;      ///< 0 for an origin that is received directly.
  std::uint32_t reliable = 0;  ///< Number of reliable messages, see MessageStore.

  bool operator==(const OverlayHeld&) const = default;
};

/// Messages that a robot holds, as its status reports them to the robots that receive it directly.
struct OverlaySummary {
  std::uint64_t states = 0;  ///< Hash of the numbers of all states that it holds.
  /// One for each known robot that is not received directly, or whose reliable messages are held;
  /// ascending by robot. Empty if all robots receive each other directly all the time.
  std::vector<OverlayHeld> holds = {};
  std::uint64_t own_states = 0;  ///< Hash of its own states alone.
  /// In a team with keys: robots whose statuses arrive, but not their packets. They renew their DDS
  /// writers.
  std::vector<RobotId> missed = {};

  bool operator==(const OverlaySummary&) const = default;
};

}  // namespace km
