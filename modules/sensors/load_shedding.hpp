#pragma once

#include <deque>
#include <optional>

#include "modules/core/processing_load.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// What a robot does with an image that has come.
enum class FrameUse {
  kNone,      ///< Left out, before it is decoded. Its inertial samples are kept.
  kOdometry,  ///< Without depth and labels that only the map needs.
  kAll,
};

/// Decides which images a robot uses when its processors are short, in this order:
///  1. odometry is more than half of max_lag_s late: the map gets no new frames;
///  2. more than max_lag_s: odometry gets every second image, then every third and fourth, each
///  step
///     only after the one before has had time to help, and only while half of the features would
///     still be tracked from one image to the next (max_stride());
///  3. more than twice max_lag_s: a recording's clock waits for pause_s(); live images are dropped,
///  as
///     a camera overwrites them.
/// In the other direction the steps are undone one by one once odometry has been on time for a
/// while. An undone step that has to be repeated soon doubles that time.
///
/// Times are in seconds of any one clock, which is passed in. Not thread-safe.
class LoadShedding {
 public:
  static constexpr int kMaxStride = 4;
  static constexpr double kMinTrackedShare = 0.5;  ///< See max_stride().

  /// Throws std::invalid_argument unless max_lag_s >= 0.
  explicit LoadShedding(double max_lag_s);

  /// The use of the next image, which was or is due at `due_s`. An image that is used counts as
  /// unfinished until finish().
  [[nodiscard]] FrameUse use_next(Stamp stamp, double due_s, double now_s);

  /// Odometry has finished with this frame and all before it.
  void finish(const ProcessedFrame& frame);

  [[nodiscard]] const ShedLoad& load() const { return load_; }

  /// How late odometry is at `now_s`: since when the first unfinished frame is due, at least zero.
  [[nodiscard]] double lag_s(double now_s) const;

  /// How long a recording's clock has to pause before an image that is due at `due_s`: zero unless
  /// this image, or odometry, is more than twice max_lag_s late; then until it is 1.5 times
  /// max_lag_s late.
  [[nodiscard]] double pause_s(double due_s, double now_s) const;

  /// The clock pauses: all unfinished frames are due later by `s`.
  void pause(double s);

  /// Largest stride at which odometry holds on. The share of features that are lost per second is
  /// measured; the share that survives an interval falls exponentially with the interval. At this
  /// stride at least kMinTrackedShare survives.
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
  int left_out_ = 0;       // images in a row
  double period_s_ = 0.0;  // of the images, used or not
  std::optional<Stamp> last_image_, last_finished_;
  double loss_per_s_ = 0.0;  // rate at which features are lost, smoothed
  double changed_s_ = 0.0;   // when the stride changed last
  std::optional<double> calm_since_s_;
  double calm_needed_s_;
  bool undone_ = false;  // the last change of the stride was an undone step
};

}  // namespace km
