#pragma once

namespace km {

/// What odometry has met with since its construction.
struct VioStatistics {
  int images = 0;  ///< Accepted.
  int refused_images = 0;
  int refused_samples = 0;
  int gaps = 0;
  int divergences = 0;
  int starts = 0;
  int start_attempts = 0;
  int rests = 0;                ///< Times that the body came to stand still.
  int images_without_pose = 0;  ///< Given up: no start was possible with them.
  int vision_losses = 0;        ///< See VisionWatch.
  double blind_s = 0.0;         ///< Time in them.
};

}  // namespace km
