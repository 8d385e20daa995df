#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "modules/core/label_palette.hpp"
#include "modules/view/view_update.hpp"

namespace km {

/// What the robots of a finished run told, or would have, ascending by time.
struct RunPlayback {
  std::vector<ViewUpdate> updates;
  LabelPalette palette;            ///< Of the first robot that has one.
  std::vector<std::string> notes;  ///< Files and robots that are missing, and why.
};

/// Reads the folder of a team's results, or of one robot's. The run begins at `begin`.
///
/// Results do not say when all was known. Keyframes, poses and closures are told at the time of
/// their images; a piece of the mesh when the robot came nearest to it. A robot joins others with
/// the first closure of both that was kept; its rounds alone are before, those with others follow
/// by what had been sent for them. Before it joins, what it has is in its own frame and as odometry
/// made it, from then on as it ended. Loads of modules are means.
/// Robots that still run or were killed are noted. Throws std::runtime_error if the folder has no
/// results, or only theirs.
[[nodiscard]] RunPlayback read_run(const std::filesystem::path& folder, Stamp begin);

}  // namespace km
