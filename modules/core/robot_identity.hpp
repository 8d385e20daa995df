#pragma once

#include <compare>
#include <cstdint>
#include <string>

#include "modules/core/ids.hpp"

namespace km {

/// Version of the protocol between robots as a whole: robots of different versions do not talk.
/// Fields appended to a topic type do not change it, see idl/README.md.
inline constexpr std::uint16_t kProtocolVersion = 1;

/// A process of a robot: a restarted robot keeps its id and gets another boot.
struct TeamPeer {
  RobotId robot = 0;
  std::uint64_t boot = 0;
  auto operator<=>(const TeamPeer&) const = default;
};

/// What a robot tells of itself before anything else.
struct RobotIdentity {
  RobotId robot = 0;
  std::string name;  ///< 1 to 64 printable ASCII characters without ';'.
  std::uint16_t protocol = kProtocolVersion;
  std::uint64_t boot = 0;  ///< Random, not zero: tells a restarted robot from its former self.

  bool operator==(const RobotIdentity&) const = default;
};

}  // namespace km
