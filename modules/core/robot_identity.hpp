#pragma once

#include <compare>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "modules/core/ids.hpp"

namespace km {

/// Version of the protocol between robots as a whole. Robots of different versions do not
/// communicate. Fields appended to a topic type do not change it, see idl/README.md.
inline constexpr std::uint16_t kProtocolVersion = 15;

/// Each process of a robot has its own boot id, not zero. The upper 48 bits are the incarnation,
/// the lower 16 count how often it was resumed. Processes of one incarnation have the same
/// keyframes. In another incarnation an index means another keyframe.
inline constexpr unsigned kResumeBits = 16;

[[nodiscard]] constexpr bool is_same_incarnation(std::uint64_t a, std::uint64_t b) {
  return a >> kResumeBits == b >> kResumeBits;
}

[[nodiscard]] constexpr std::uint32_t resume_count(std::uint64_t boot) {
  return static_cast<std::uint32_t>(boot & ((1U << kResumeBits) - 1U));
}

/// Boot id of the next process of the incarnation of `boot`. Throws std::overflow_error if the
/// incarnation has been resumed too often.
[[nodiscard]] inline std::uint64_t next_boot(std::uint64_t boot) {
  if (!is_same_incarnation(boot, boot + 1))
    throw std::overflow_error("an incarnation of a robot was resumed " +
                              std::to_string(resume_count(boot)) + " times, which is the maximum");
  return boot + 1;
}

/// A process of a robot: a restarted or resumed robot keeps its id and gets another boot id.
struct TeamPeer {
  RobotId robot = 0;
  std::uint64_t boot = 0;
  auto operator<=>(const TeamPeer&) const = default;
};

/// Identity that a robot publishes before anything else.
struct RobotIdentity {
  RobotId robot = 0;
  std::string name;  ///< 1 to 64 printable ASCII characters without ';'.
  std::uint16_t protocol = kProtocolVersion;
  std::uint64_t boot = 0;  ///< Distinguishes this process from the robot's former ones.

  bool operator==(const RobotIdentity&) const = default;
};

}  // namespace km
