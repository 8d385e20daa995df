#pragma once

#include <deque>
#include <optional>

#include "modules/core/data/processing_load.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// How a robot uses a new image.
enum class FrameUse {
  kNone,      ///< Not used and not decoded; its inertial samples are kept.
  kOdometry,  ///< Used for odometry only, without depth and labels for the map.
  kAll,
};

/// Decides which images a robot uses when its processors are too slow, in this order:
/// 1. If odometry is late by more than half of max_lag_s, the map gets no new frames.
/// 2. If odometry is late by more than max_lag_s, it gets every second image, then every third and
///    fourth. The next step follows only after the former step has had time to take effect. At
///    least half of the features must still be tracked from one image to the next (max_stride()).
/// 3. If odometry is late by more than twice max_lag_s, a recording's clock waits for pause_s().
///    Live images are dropped.
///
/// The steps are undone one by one, each after odometry has been on time for 2 s. If the step after
/// an undone step again reduces the load, this time doubles, up to 30 s.
///
/// Times are arguments, in seconds of any one clock. Not thread-safe.
class LoadShedding {
 public:
  static constexpr int kMaxStride = 4;
  static constexpr double kMinTrackedShare = 0.5;  ///< See max_stride().

  /// Throws std::invalid_argument unless max_lag_s >= 0.
  explicit LoadShedding(double max_lag_s);

  /// The use of the next image, which is due at `due_s`. A used image counts as unfinished until
  /// finish().
  [[nodiscard]] FrameUse use_next(Stamp stamp, double due_s, double now_s);

  /// Notes that odometry has finished this frame and all frames before it.
  void finish(const ProcessedFrame& frame);

  [[nodiscard]] const ShedLoad& load() const { return load_; }

  /// Delay of odometry at `now_s` [s]: time since the first unfinished frame was due, at least
  /// zero.
  [[nodiscard]] double lag_s(double now_s) const;

  /// Pause of a recording's clock before an image that is due at `due_s` [s]. Zero unless this
  /// image, or odometry, is late by more than twice max_lag_s; then the pause lasts until the delay
  /// is 1.5 times max_lag_s.
  [[nodiscard]] double pause_s(double due_s, double now_s) const;

  /// Notes a pause of the clock: all unfinished frames are due later by `s`.
  void pause(double s);

  /// Largest stride at which odometry still works. The share of features that are lost per second
  /// is measured, and the share that survives an interval falls exponentially with the interval. At
  /// this stride at least kMinTrackedShare survives.
  [[nodiscard]] int max_stride() const;

 private:
  struct Unfinished {
    Stamp stamp = 0;
    double due_s = 0.0;
  };

  void adapt(double lag_s, double now_s);
  void take_step(double now_s);
  void undo_step(double now_s);

  double max_lag_s_;
  ShedLoad load_;
  std::deque<Unfinished> unfinished_;
  int left_out_ = 0;       // unused images in a row
  double period_s_ = 0.0;  // interval between images, used or not
  std::optional<Stamp> last_image_, last_finished_;
  double loss_per_s_ = 0.0;  // rate at which features are lost, smoothed
  double changed_s_ = 0.0;   // time of the last change of the stride
  std::optional<double> calm_since_s_;
  double calm_needed_s_;
  bool undone_ = false;  // the last change undid a step
};

}  // namespace km
