#pragma once

#include <optional>

#include "modules/core/stamp.hpp"

namespace km {

/// Loss or return of vision.
struct VisionEvent {
  bool is_lost = false;   ///< False if vision is back.
  Stamp since = 0;        ///< First image of the loss.
  double lasted_s = 0.0;  ///< Duration up to this image.
  int features = 0;       ///< Number of features in this image.
};

/// Detects from each image whether vision still determines the pose. An image holds the pose if it
/// shows at least kMinLandmarks located landmarks. Vision is lost when no image has held the pose
/// for the patience, and returns with the next image that holds the pose.
class VisionWatch {
 public:
  static constexpr int kMinLandmarks = 8;
  static constexpr double kPatience_s = 0.3;

  explicit VisionWatch(double patience_s = kPatience_s) : patience_s_(patience_s) {}

  /// Adds an image with `features` features, `seen` of them located landmarks; `seen` is 0 while
  /// odometry has no pose. Stamps ascend. There is no loss before the first image that holds the
  /// pose.
  [[nodiscard]] std::optional<VisionEvent> add(Stamp stamp, int features, int seen);

  [[nodiscard]] bool is_lost() const { return is_lost_; }
  [[nodiscard]] int losses() const { return losses_; }
  /// Total duration of all losses so far, each from its first image [s].
  [[nodiscard]] double lost_s() const { return lost_s_ + (is_lost_ ? now_lost_s_ : 0.0); }

 private:
  double patience_s_;
  bool has_seen_ = false;
  bool is_lost_ = false;
  int losses_ = 0;
  std::optional<Stamp> since_;  // first image that did not hold the pose
  double now_lost_s_ = 0.0;     // duration of the current loss
  double lost_s_ = 0.0;         // total of the losses that are over
};

}  // namespace km
