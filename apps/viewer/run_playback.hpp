#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "modules/core/label_palette.hpp"
#include "modules/view/view_update.hpp"

namespace km {

/// Updates of the robots of a finished run, as reconstructed from its results, ascending by time.
struct RunPlayback {
  std::vector<ViewUpdate> updates;
  LabelPalette palette;            ///< Palette of the first robot that has one.
  std::vector<std::string> notes;  ///< Missing files and robots, with the reason.
};

/// Reads the folder of a team's results, or of one robot's. The run begins at `begin`.
///
/// Results do not contain the time of every update. Keyframes, poses and closures get the time of
/// their images, a mesh chunk the time at which the robot came nearest to it. A robot joins others
/// at the time of the first kept closure between them. Its rounds alone are before that time. Its
/// rounds with others follow, spaced by the bytes sent for them. Before it joins, its data are in
/// its own frame and as odometry estimated them. Afterwards they are as they were at the end of the
/// run. Loads of modules are means. `notes` lists robots that still run or were killed. Throws
/// std::runtime_error if the folder has no results of a finished robot.
[[nodiscard]] RunPlayback read_run(const std::filesystem::path& folder, Stamp begin);

}  // namespace km
