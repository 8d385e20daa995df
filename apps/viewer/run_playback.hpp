#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "modules/core/map/label_palette.hpp"
#include "modules/view/view_update.hpp"

namespace km {

/// Updates of the robots of a run, from their journals, ascending by time.
struct RunPlayback {
  std::vector<ViewUpdate> updates;
  LabelPalette palette;            ///< Palette of the first robot that has one.
  std::vector<std::string> notes;  ///< Missing or damaged files, and robots whose run has not
                                   ///< ended.
};

/// Reads the folder of a team's results, or of one robot's. The first update gets the time `begin`.
/// Times in which no process ran are shortened to kMaxPause_s.
///
/// The updates are those that a viewer would have received from the running robots, without images
/// and without the limits of a budget. ViewSelector, which robots use, chooses them from the events
/// of the journal. Throws std::runtime_error if the folder has no journal of a robot.
///
/// Meshes are those of the end of the run. A chunk is shown from the event that states that its
/// cell has faces. The mesh depends on the anchor of the robot at that event:
/// - the anchor at the end of the run: the optimised mesh;
/// - otherwise, the robot itself: the mesh of its map;
/// - otherwise, another robot: no mesh.
///
/// Objects and 2D map are those of the end of the run, and are shown from then on. So is the fused
/// mesh of the first robot in each frame that has one.
[[nodiscard]] RunPlayback read_run(const std::filesystem::path& folder, Stamp begin);

inline constexpr double kMaxPause_s = 10.0;

}  // namespace km
