#pragma once

#include <cstdint>
#include <vector>

#include "modules/core/robot_identity.hpp"

namespace km {

/// How much of what a robot told another one holds without a gap, from the first on.
struct RelayHeld {
  TeamPeer origin;
  std::uint32_t bags = 0;     ///< 0 of an origin that is heard directly.
  std::uint32_t letters = 0;  ///< See RelayStore.

  bool operator==(const RelayHeld&) const = default;
};

/// What a robot tells of its part in the relay, ascending by robot. Where all robots hear each
/// other `holds` is empty.
struct RelaySummary {
  std::vector<RobotId> hears;         ///< Directly.
  std::vector<RelayHeld> holds = {};  ///< Of each robot known but not heard, or with letters.

  bool operator==(const RelaySummary&) const = default;
};

}  // namespace km
