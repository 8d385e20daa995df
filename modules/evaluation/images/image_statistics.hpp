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

/// Frames of a sequence that are analysed.
struct ImageStatisticsOptions {
  /// Interval in frames of the ORB and left-right figures, and of the starts of KLT tracks.
  int stride = 5;
  double max_step_s = 0.25;  ///< Frames further apart end a track.
};

/// Properties of a sequence of stereo images for feature trackers and matchers: one pass over the
/// frames, any length. Not thread-safe.
class ImageStatistics {
 public:
  /// Throws std::invalid_argument unless stride >= 1 and max_step_s > 0.
  explicit ImageStatistics(const StereoRig& rig, const ImageStatisticsOptions& options = {});

  /// Adds the next pair, in order of time and with the rig's resolution. It is copied. Without a
  /// right image (RGB-D) the figures of the right camera are missing.
  void add(const StereoFrame& frame);

  /// Adds a pair that counts only for the figures at standstill, from another part of the recording
  /// in which the camera stands still.
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
