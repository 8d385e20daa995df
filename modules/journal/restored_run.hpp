#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "modules/journal/journal_entry.hpp"
#include "modules/journal/journal_file.hpp"

namespace km {

/// A run up to the last keyframe that its journal contains in full. Odometry continues from the
/// image of that keyframe.
struct RestoredRun {
  RobotId robot = 0;
  std::uint64_t boot = 0;  ///< Boot id of the last process.
  std::string input;       ///< Input of the robot, see JournalStart.

  std::vector<KeyframeOdometry> odometry;  ///< Index i is keyframe i.
  std::vector<Keyframe> keyframes;         ///< Index i is keyframe i, as in `odometry`.
  std::vector<JournalPlace> places;        ///< Places of the keyframes in the journal.
  /// States of all images. States after the last keyframe stay until they are estimated again.
  std::vector<OdometryState> states;
  std::vector<Closure> closures;  ///< Closures of this robot and of others, each once.
  /// Final outcomes of candidates: those verified whose closures are known, and those refused.
  std::vector<ClosureOutcome> outcomes;
  std::map<RobotId, JournalPeer> peers;  ///< Last known identities.

  JournalExtent journal = {};  ///< Position at which writing continues.

  /// Number of states up to the last keyframe; 0 without one.
  [[nodiscard]] std::size_t final_states() const;
};

/// The run with another robot id, without calibrations and without results with other robots.
[[nodiscard]] RestoredRun alone_as(RobotId robot, RestoredRun run);

/// Reads the journal of a run. Throws InputFileError, also for entries that contradict each other.
[[nodiscard]] RestoredRun restore_run(const std::filesystem::path& file);

}  // namespace km
