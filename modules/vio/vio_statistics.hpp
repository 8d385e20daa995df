#pragma once

namespace km {

/// Counts of one odometry since its construction.
struct VioStatistics {
  bool has_imu = true;  ///< False: odometry by images alone, and z of odom is not the vertical.
  int images = 0;       ///< Accepted images.
  int refused_images = 0;
  int refused_samples = 0;
  int gaps = 0;
  int divergences = 0;     ///< Includes the contradictions.
  int contradictions = 0;  ///< Divergences found because images contradicted the estimate.
  int starts = 0;
  int start_attempts = 0;
  int rests = 0;
  int images_without_pose = 0;  ///< Images dropped because no start was possible.
  int vision_losses = 0;        ///< Number of losses; see VisionWatch.
  double blind_s = 0.0;         ///< Total duration of the losses.
};

}  // namespace km
