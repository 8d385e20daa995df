#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "modules/core/decoded.hpp"
#include "modules/core/keyframe.hpp"
#include "modules/core/odometry.hpp"
#include "modules/core/pose_graph.hpp"

namespace km {

/// A process begins a run, or takes it up.
struct JournalStart {
  RobotId robot = 0;
  std::uint64_t boot = 0;  ///< Of the process, see RobotIdentity.
  std::string input;       ///< What the robot perceives, as its command line names it.
};

/// Another robot, as met: what follows with it is with this life of it (see RobotIdentity).
struct JournalPeer {
  RobotId robot = 0;
  std::uint64_t boot = 0;
  std::string name;
};

/// What a robot cannot work out anew once its process has died. Everything else follows from it.
using JournalEntry = std::variant<JournalStart, OdometryState, KeyframeOdometry, Keyframe, Closure,
                                  ClosureOutcome, JournalPeer>;

/// No entry is longer [bytes].
inline constexpr std::size_t kMaxJournalEntry_bytes = std::size_t{1} << 22U;

/// A byte for the kind, then the members in order of declaration, least significant byte first; all
/// numbers come back to the last bit.
[[nodiscard]] std::vector<std::uint8_t> encode_journal_entry(const JournalEntry& entry);

/// Refuses what encode_journal_entry() never writes, numbers that are not finite, and covariances
/// of states that odometry cannot go on from (is_usable()).
[[nodiscard]] Decoded<JournalEntry> decode_journal_entry(std::span<const std::uint8_t> bytes);

}  // namespace km
