#pragma once

#include <optional>

#include "modules/core/stamp.hpp"

namespace km {

/// Vision was lost, or came back.
struct VisionEvent {
  bool is_lost = false;   ///< Else it is back.
  Stamp since = 0;        ///< First image of the loss.
  double lasted_s = 0.0;  ///< Up to this image.
  int features = 0;       ///< Of this image.
};

/// Finds out from what each image adds to odometry whether it still sees. Vision is lost once no
/// image has held the pose for kPatience_s, and back with one that does.
class VisionWatch {
 public:
  static constexpr int kLeastSeen = 8;  ///< Located landmarks of an image that hold its pose.
  static constexpr double kPatience_s = 0.3;

  /// An image with so many features, of which so many are landmarks that are located; 0 while
  /// odometry has no pose. Stamps ascend. Nothing is lost before something was seen.
  [[nodiscard]] std::optional<VisionEvent> add(Stamp stamp, int features, int seen);

  [[nodiscard]] bool is_lost() const { return is_lost_; }
  [[nodiscard]] int losses() const { return losses_; }
  /// Of all losses, each from its first image, so far [s].
  [[nodiscard]] double lost_s() const { return lost_s_ + (is_lost_ ? now_lost_s_ : 0.0); }

 private:
  bool has_seen_ = false;
  bool is_lost_ = false;
  int losses_ = 0;
  std::optional<Stamp> since_;  // the first image that did not hold the pose
  double now_lost_s_ = 0.0;     // since then
  double lost_s_ = 0.0;         // of the losses that are over
};

}  // namespace km
