#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "apps/team/team_results.hpp"

namespace km {

struct ClosureImageOptions {
  std::size_t max_closures = 200;  ///< About 2 MB of a page.
  int width_px = 160;              ///< Smaller ones stay as they are.
  int quality = 60;                ///< Of JPEG, 0 to 100.
};

/// What robots saw where they closed loops, for people.
struct ClosureImages {
  std::map<KeyframeId, std::string> jpegs;  ///< Bytes of files, of left images.
  std::vector<std::string> notes;           ///< What is left out, and why, a line each.
};

/// The images of both keyframes of each closure that was kept, or verified and then rejected, from
/// the recordings that the plans name: EuRoC folders, and bags by the --rig of their robot. Of too
/// many closures those that were rejected come first, then those between robots, of the last that
/// are shown every so many. A recording that cannot be read any more is a note.
[[nodiscard]] ClosureImages closure_images(const std::vector<RobotResult>& robots,
                                           const ClosureImageOptions& options = {});

}  // namespace km
