#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "modules/core/data/closure_verdicts.hpp"
#include "modules/core/data/keyframe.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/core/data/pose_changes.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/core/data/received_fix.hpp"
#include "modules/core/data/robot_sample.hpp"
#include "modules/core/decoded.hpp"
#include "modules/core/map/mesh_cells.hpp"

namespace km {

/// The start of a process that begins or resumes a run.
struct JournalStart {
  RobotId robot = 0;
  std::uint64_t boot = 0;  ///< Boot id of the process, see RobotIdentity.
  std::string input;       ///< Input of the robot as its command line names it.
};

/// A contact with another robot. Later entries about that robot refer to this incarnation (see
/// RobotIdentity).
struct JournalPeer {
  RobotId robot = 0;
  std::uint64_t boot = 0;
  std::string name;
};

/// Events of a run, see README. A resumed process restores its state from them, except for
/// RobotSample and MeshCells, which are for viewers.
using JournalEntry =
    std::variant<JournalStart, OdometryState, KeyframeOdometry, Keyframe, Closure, ClosureOutcome,
                 JournalPeer, ClosureJudgements, PoseChanges, RobotSample, MeshCells, ReceivedFix>;

/// Maximum size of an entry [bytes].
inline constexpr std::size_t kMaxJournalEntry_bytes = std::size_t{1} << 22U;

/// Encodes the kind in a byte, then the members (see ArchiveWriter). Decoding restores all numbers
/// exactly.
[[nodiscard]] std::vector<std::uint8_t> encode_journal_entry(const JournalEntry& entry);

/// Refuses bytes that encode_journal_entry() never writes, numbers that are not finite, and state
/// covariances that odometry cannot continue from (is_usable()).
[[nodiscard]] Decoded<JournalEntry> decode_journal_entry(std::span<const std::uint8_t> bytes);

}  // namespace km
