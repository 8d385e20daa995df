#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "apps/team/team_results.hpp"

namespace km {

struct ClosureImageOptions {
  std::size_t max_closures = 200;  ///< About 2 MB of a page.
  int width_px = 160;              ///< Narrower images keep their width.
  int quality = 60;                ///< JPEG quality, 0 to 100.
};

/// Images of the keyframes of closures, for people.
struct ClosureImages {
  std::map<KeyframeId, std::string> jpegs;  ///< Left images as JPEG files.
  std::vector<std::string> notes;           ///< Parts left out with the reason, one per line.
};

/// Images of both keyframes of every closure that was kept, or verified and then rejected. They are
/// read from the recordings that the plans name: EuRoC folders, and bags with the --rig of their
/// robot. If there are more than `max_closures`, rejected closures come first, then closures
/// between robots, then closures of one robot. An unreadable recording adds a note.
[[nodiscard]] ClosureImages closure_images(const std::vector<RobotResult>& robots,
                                           const ClosureImageOptions& options = {});

}  // namespace km
