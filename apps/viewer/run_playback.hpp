#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "modules/core/label_palette.hpp"
#include "modules/view/view_update.hpp"

namespace km {

/// Updates of the robots of a run, from their journals, ascending by time.
struct RunPlayback {
  std::vector<ViewUpdate> updates;
  LabelPalette palette;            ///< Palette of the first robot that has one.
  std::vector<std::string> notes;  ///< Missing or damaged files, and robots without an end.
};

/// Reads the folder of a team's results, or of one robot's. The run begins at `begin`. Times in
/// which no process ran are shortened to kMaxPause_s.
///
/// The updates are those that a viewer would have received from the running robots, without images
/// and without the limits of a budget. ViewSelector, which robots use, chooses them from the events
/// of the journal. Meshes are those of the end of the run. A chunk in the frame of the end
/// is shown from the time at which its cell had faces, before that in the frame of the robot alone.
/// Throws std::runtime_error if the folder has no journal of a robot.
[[nodiscard]] RunPlayback read_run(const std::filesystem::path& folder, Stamp begin);

inline constexpr double kMaxPause_s = 10.0;

}  // namespace km
