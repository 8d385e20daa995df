#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "modules/absolute_fixes/fix_reader.hpp"
#include "modules/core/odometry.hpp"
#include "modules/core/position_fix.hpp"

namespace km {

/// Assigns fixes to keyframes: each fix to the nearest keyframe in time, and to each keyframe only
/// the nearest fix. Odometry between both moves the measured point into the frame of the keyframe,
/// so that the fix need not be taken at an image. Inputs may come in any interleaving, each kind in
/// order of time. Not thread-safe.
class FixAssociation {
 public:
  /// `p_body`: the antenna or marker in the body frame [m]. `correlation_s`: see PositionFix.
  explicit FixAssociation(const Eigen::Vector3d& p_body, double correlation_s = 0.0)
      : p_body_(p_body), correlation_s_(correlation_s) {}

  void add(const OdometryState& state) { states_.push_back(state); }
  void add(const KeyframeOdometry& keyframe) {
    keyframes_.push_back({keyframe.id, keyframe.stamp});
  }
  void add(const TimedPosition& fix) { fixes_.push_back(fix); }

  /// Fixes of the keyframes that are decided. A keyframe is decided once the next keyframe is
  /// known, and a fix after the middle between both has come, or has not come for two seconds.
  [[nodiscard]] std::vector<PositionFix> take(std::uint64_t datum);

  /// Number of fixes without a keyframe.
  [[nodiscard]] std::size_t unused() const { return unused_; }

 private:
  struct TimedKeyframe {
    KeyframeId id;
    Stamp stamp = 0;
  };
  [[nodiscard]] std::optional<SE3> pose_at(Stamp stamp) const;
  [[nodiscard]] std::optional<PositionFix> nearest_fix(const TimedKeyframe& keyframe, Stamp end);

  Eigen::Vector3d p_body_;
  double correlation_s_ = 0.0;
  std::deque<OdometryState> states_;
  std::deque<TimedKeyframe> keyframes_;  // not yet decided
  std::deque<TimedPosition> fixes_;      // without a keyframe so far
  std::size_t unused_ = 0;
};

}  // namespace km
