#pragma once

#include <optional>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/vio/vio.hpp"
#include "modules/vio/vio_config.hpp"

namespace km {

/// Publishes the poses of an external odometry (see MeasuredPose) in place of Vio, with keyframes
/// by the rules of Vio (is_keyframe_due()). The covariance of a keyframe's relative pose is the
/// growth of the odometry's covariance since the previous keyframe (between_on_chain()), plus the
/// drift of VioConfig. The steps are assumed to be independent. A constant covariance, as many
/// drivers report it, adds nothing. No verticals are published, because z of `odom` may not point
/// up. Not thread-safe.
class ExternalOdometry {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  ExternalOdometry(RobotId robot, DepthSource depth_source, const VioConfig& config);

  /// Continues after the last published keyframe of an earlier process, in the same odometry. If
  /// the state is unknown, the next keyframe has unknown_step_covariance().
  void continue_from(const VioCheckpoint& checkpoint);

  /// Without a state if the packet has no usable pose. kJumped: the pose jumped faster than
  /// VioConfig::max_speed_mps, and the jump is removed from published poses.
  [[nodiscard]] VioResult process(const SensorPacket& packet);

 private:
  struct StampedMeasurement {
    Stamp stamp;
    MeasuredPose pose;
  };

  [[nodiscard]] bool is_jump(const StampedMeasurement& measured) const;
  void count_motion(const StampedMeasurement& measured);
  [[nodiscard]] Matrix6 step_covariance(const StampedMeasurement& measured) const;
  void add_keyframe(const StampedMeasurement& measured, const SE3& T_odom_body, bool has_jumped,
                    VioResult& result);

  RobotId robot_;
  DepthSource depth_source_;
  VioConfig config_;
  bool continues_ = false;  // true from continue_from() to the first usable pose
  std::optional<StampedMeasurement> last_, last_kf_;  // as measured
  std::optional<KeyframeOdometry> last_keyframe_;
  double moved_s_ = 0.0;                      // time in motion since the last keyframe
  SE3 T_odom_last_motion_ = SE3::Identity();  // measured pose at the last counted motion
  SE3 T_chain_odom_ = SE3::Identity();  // from measured to published odometry; changed by a jump
};

}  // namespace km
