#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "modules/absolute_fixes/fix_reader.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/core/data/position_fix.hpp"
#include "modules/core/data/stamped_pose.hpp"

namespace km {

/// Assigns fixes to keyframes: each fix to the nearest keyframe in time, and to each keyframe only
/// the nearest fix. Odometry between both moves the measured point into the frame of the keyframe,
/// so that the fix need not be taken at an image. Inputs may come in any interleaving, each kind in
/// order of time; fixes and keyframes at most kDelay_ns after the poses around them. The memory
/// does not grow while the robot rests and makes no keyframe. Not thread-safe.
class FixAssociation {
 public:
  static constexpr Stamp kDelay_ns = 60'000'000'000;
  /// Number of fixes without a pose that are stored besides the recorded ones. The oldest are
  /// dropped: odometry does not work.
  static constexpr std::size_t kMaxAhead = 100'000;

  /// `p_body`: the antenna or marker in the body frame [m]. `correlation_s`: see PositionFix.
  /// `recorded`: fixes that are known at the start.
  explicit FixAssociation(const Eigen::Vector3d& p_body, double correlation_s = 0.0,
                          const std::vector<TimedPosition>& recorded = {});

  void add(const OdometryState& state) { poses_.push_back({state.stamp, state.T_odom_body}); }
  void add(const KeyframeOdometry& keyframe) {
    keyframes_.push_back({keyframe.id, keyframe.stamp});
  }
  void add(const TimedPosition& fix);

  /// Fixes of the keyframes that are decided. A keyframe is decided once the next keyframe is
  /// known, and a fix after the middle between both has come, or has not come for two seconds.
  [[nodiscard]] std::vector<PositionFix> take(std::uint64_t datum);

  /// Number of fixes without a keyframe.
  [[nodiscard]] std::size_t unused() const { return unused_; }
  /// Number of poses and fixes in memory.
  [[nodiscard]] std::size_t stored() const {
    return poses_.size() + ahead_.size() + located_.size();
  }

 private:
  struct TimedKeyframe {
    KeyframeId id;
    Stamp stamp = 0;
    std::optional<SE3> T_odom_kf = {};
  };
  struct LocatedFix {
    TimedPosition fix;
    SE3 T_odom_body;
  };
  void locate();
  [[nodiscard]] std::optional<SE3> pose_at(Stamp stamp) const;
  [[nodiscard]] std::optional<PositionFix> nearest_fix(const TimedKeyframe& keyframe, Stamp end);
  void forget_before(Stamp end);

  Eigen::Vector3d p_body_;
  double correlation_s_ = 0.0;
  std::size_t max_ahead_;
  std::deque<StampedPose> poses_;        // T_odom_body
  std::deque<TimedKeyframe> keyframes_;  // not yet decided
  std::deque<TimedPosition> ahead_;      // after the last pose
  std::deque<LocatedFix> located_;       // before it, without a keyframe so far
  Stamp newest_fix_;
  std::size_t unused_ = 0;
};

}  // namespace km
