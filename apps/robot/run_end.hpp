#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "modules/core/ids.hpp"
#include "runtime/supervisor.hpp"

namespace km {

/// What became of the images of a recording.
struct ImageCounts {
  std::size_t listed = 0;     ///< Stereo pairs of the part that was to be played.
  std::size_t read = 0;       ///< Handed to odometry.
  std::size_t skipped = 0;    ///< Given up because odometry lagged behind the rate.
  std::size_t with_pose = 0;  ///< That odometry estimated a pose of.
};

/// How a run came to its end.
struct RunEnd {
  RobotId robot = 0;
  RunResult result;
  bool id_taken = false;              ///< Another living robot claimed the same id meanwhile.
  const char* departure = nullptr;    ///< Why the robot left its team, if it did.
  std::optional<ImageCounts> images;  ///< Absent for a robot without sensors.
};

/// What the robot says of its run, to people and to the process that started it.
struct Verdict {
  int exit_code = 0;
  std::string reason;  ///< One line.
};

/// 3 if a module failed, or another robot claimed the id: whose data the team then used is
/// anybody's guess. 1 if the run came to its end and not one image has a pose. 0 otherwise.
[[nodiscard]] Verdict verdict_of(const RunEnd& end);

/// "2910 of 2912 images have a pose".
[[nodiscard]] std::string to_string(const ImageCounts& images);

}  // namespace km
