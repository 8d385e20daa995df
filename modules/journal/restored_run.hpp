#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "modules/journal/journal_entry.hpp"
#include "modules/journal/journal_file.hpp"

namespace km {

/// A run up to the last keyframe that its journal knows in full: from there on odometry goes on, on
/// the image of that keyframe.
struct RestoredRun {
  RobotId robot = 0;
  std::uint64_t boot = 0;  ///< Of the last process.
  std::string input;       ///< See JournalStart.

  std::vector<KeyframeOdometry> odometry;  ///< Index i is keyframe i.
  std::vector<Keyframe> keyframes;         ///< Likewise, equally many.
  std::vector<JournalPlace> places;        ///< Of these in the journal.
  /// Of all images: those behind the last keyframe's stand until they are estimated anew.
  std::vector<OdometryState> states;
  std::vector<Closure> closures;  ///< Own and of the others, each once from either side.
  /// Of candidates that nothing more becomes of: those verified, whose closures are there, and
  /// those refused.
  std::vector<ClosureOutcome> outcomes;
  std::map<RobotId, JournalPeer> peers;  ///< As last met.

  JournalExtent journal = {};  ///< Where to go on writing.

  /// Number of states up to the last keyframe; 0 without one.
  [[nodiscard]] std::size_t final_states() const;
};

/// The run under another id, without its sensors, and what it shared with the others of its time.
[[nodiscard]] RestoredRun alone_as(RobotId robot, RestoredRun run);

/// Reads the journal of a run. Throws InputFileError, also for entries that contradict each other.
[[nodiscard]] RestoredRun restore_run(const std::filesystem::path& file);

}  // namespace km
