#pragma once

#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/evaluation/images/image_figure.hpp"
#include "modules/evaluation/images/level_statistics.hpp"
#include "modules/evaluation/images/stereo_statistics.hpp"
#include "modules/evaluation/images/still_statistics.hpp"
#include "modules/evaluation/images/track_statistics.hpp"

namespace km {

/// How much of a sequence is looked at.
struct ImageStatisticsOptions {
  /// ORB and left-right figures are taken, and KLT tracks started, at every so many frames.
  int stride = 5;
  double max_step_s = 0.25;  ///< Frames further apart are no step of a track.
};

/// What a sequence of stereo images is like, as feature trackers and matchers see it: one pass over
/// the frames, any length. Not thread-safe.
class ImageStatistics {
 public:
  /// Throws std::invalid_argument unless stride >= 1 and max_step_s > 0.
  explicit ImageStatistics(const StereoRig& rig, const ImageStatisticsOptions& options = {});

  /// The next pair, in order of time and of the rig's resolution. It may end after the call.
  /// Without a right image (RGB-D) the figures of the right camera are missing.
  void add(const StereoFrame& frame);

  /// A pair that counts for the figures of standing still only: the rest of a recording in which
  /// the camera stands still at another time than that looked at.
  void add_still(const StereoFrame& frame);

  [[nodiscard]] std::size_t frames() const { return frames_; }
  [[nodiscard]] std::vector<ImageFigure> figures() const;

 private:
  ImageStatisticsOptions options_;
  std::size_t frames_ = 0;
  TrackStatistics tracks_;
  StereoStatistics stereo_;
  LevelStatistics levels_;
  StillStatistics still_;
};

}  // namespace km
