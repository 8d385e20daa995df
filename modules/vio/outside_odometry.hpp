#pragma once

#include <optional>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/odometry.hpp"
#include "modules/vio/vio.hpp"
#include "modules/vio/vio_config.hpp"

namespace km {

/// What came of one packet.
struct OutsideOdometryResult {
  std::optional<OdometryState> state;        ///< nullopt: the packet has no pose that can be used.
  std::optional<KeyframeOdometry> keyframe;  ///< A new one.
  std::optional<LocatedFrame> frame;
  bool has_jumped = false;  ///< Faster than VioConfig::max_speed_mps: the body stays where it was.
};

/// Hands on the poses of an odometry that others made (see MeasuredPose) as Vio hands on its own,
/// with keyframes by the same rules. Of a keyframe's relative pose the covariance is what that of
/// the odometry grew by between the two, as of a chain of independent steps (between_on_chain()),
/// and VioConfig's drift: one that stays the same, as many drivers report, adds nothing. No
/// verticals are handed on: whether `odom` has z up is not known. Not thread-safe.
class OutsideOdometry {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  OutsideOdometry(RobotId robot, DepthSource depth_source, const VioConfig& config);

  /// Goes on behind that keyframe, in the same odometry.
  void continue_from(const VioCheckpoint& checkpoint);

  [[nodiscard]] OutsideOdometryResult process(const SensorPacket& packet);

 private:
  struct Fix {
    Stamp stamp;
    MeasuredPose pose;
  };

  [[nodiscard]] bool is_jump(const Fix& fix) const;
  void count_motion(const Fix& fix);
  void hand_on(const Fix& fix, const SE3& T_odom_body, bool has_jumped,
               OutsideOdometryResult& result);

  RobotId robot_;
  DepthSource depth_source_;
  VioConfig config_;
  bool goes_on_ = false;               // until the first pose
  std::optional<Fix> last_, last_kf_;  // as measured
  std::optional<KeyframeOdometry> last_keyframe_;
  double moved_s_ = 0.0;                // since then, without rests
  SE3 T_odom_rest_ = SE3::Identity();   // where it last was in motion, as measured
  SE3 T_chain_odom_ = SE3::Identity();  // from what is measured to what is handed on: after a jump
};

}  // namespace km
