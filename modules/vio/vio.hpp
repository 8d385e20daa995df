#pragma once

#include <optional>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/vio/estimate_watch.hpp"
#include "modules/vio/feature_tracker.hpp"
#include "modules/vio/fixed_lag_smoother.hpp"
#include "modules/vio/initialization.hpp"
#include "modules/vio/motion_model.hpp"
#include "modules/vio/rest_detector.hpp"
#include "modules/vio/vio_config.hpp"
#include "modules/vio/vio_statistics.hpp"
#include "modules/vio/vision_watch.hpp"

namespace km {

/// First reason for which a packet was not used in full.
enum class VioProblem {
  kNone,
  kNoImage,         ///< No image that fits the rig; inertial samples are kept.
  kUnorderedImage,  ///< The image is not later than the one before, and is dropped.
  kBadSamples,      ///< Implausible or unordered inertial samples, which are dropped.
  /// Gap between inertial samples above VioConfig::max_imu_gap_s. Images alone determine the
  /// motion. If images cannot, odometry starts again from the last pose.
  kInertialGap,
  kPause,  ///< Long pause of the images. Odometry starts again from the last pose.
  /// The estimate was implausible. Odometry starts again from the last pose.
  kDiverged,
  /// Images contradicted the estimate, see EstimateWatch. Odometry starts again from the last pose.
  kContradicted,
  /// Without an inertial sensor: images have not determined the pose for a second. Odometry starts
  /// again from the last pose with the first image that has enough features.
  kLost,
  kJumped,        ///< The poses of an external odometry jumped, see ExternalOdometry.
  kStartTimeout,  ///< No start was possible; the oldest waiting images are dropped without a pose.
};

/// Result of one packet.
struct VioResult {
  VioProblem problem = VioProblem::kNone;
  std::vector<OdometryState> states;        ///< In order of time; several at a start.
  std::vector<KeyframeOdometry> keyframes;  ///< New keyframes; several at a start.
  std::vector<LocatedFrame> frames;         ///< Images with their poses, one per state.
  std::optional<StartStatus> start;         ///< Outcome, if a start was attempted.
  TrackerStatistics tracking;               ///< Counts of this image.
  std::vector<Eigen::Vector2d> tracked;    ///< Features of this image: bearings in the left camera.
  std::optional<SmootherUpdate> smoother;  ///< Absent before the start.
  std::optional<VisionEvent> vision;       ///< Loss or return of vision.
};

/// Last keyframe before the odometry begins, and the state there. A resumed process begins with the
/// image of this keyframe.
struct VioCheckpoint {
  /// State at the image of the keyframe. nullopt: the keyframe is of another run, so that the
  /// motion since is unknown.
  std::optional<OdometryState> state;
  KeyframeOdometry keyframe;  ///< The last published keyframe.
};

/// Stereo-inertial or RGB-D-inertial odometry, or odometry by images alone if the rig has no
/// inertial sensor (motion_model.hpp): one call per image, a pose for every image.
///
/// Images of the first VioConfig::start_s are held back. Then all their poses are published at
/// once, and from there one pose per image. Images alone start with the first image. A body that
/// stands still makes no keyframes (RestDetector). The first keyframe after a rest is measured from
/// the last keyframe before the rest. Bad input is refused and reported; it does not throw. After
/// an estimate has diverged, odometry starts again from the last pose. Deterministic; not
/// thread-safe.
class Vio {
 public:
  /// Throws ConfigError, and std::invalid_argument for an unusable rig.
  Vio(RobotId robot, const SensorRig& rig, const TrackerConfig& tracker, const VioConfig& config);

  /// Continues from the checkpoint. The next keyframe index follows that of the checkpoint's
  /// keyframe. If odometry starts on the image of this keyframe, the next keyframe is measured from
  /// it. If this image comes first and the covariance of the state is known, odometry starts at
  /// once from that state. Otherwise odometry starts as usual, with the images of
  /// VioConfig::start_s. The estimated calibration is kept. If the state is unknown, the next
  /// keyframe has unknown_step_covariance(). Call before the first process().
  void continue_from(const VioCheckpoint& checkpoint);

  [[nodiscard]] VioResult process(const SensorPacket& packet);

  [[nodiscard]] const VioStatistics& statistics() const { return statistics_; }

 private:
  using Frame = std::shared_ptr<const StereoFrame>;
  struct Held {
    InertialFrame data;
    Frame frame;
  };

  int take_samples(const SensorPacket& packet);
  void drop_old_samples();
  [[nodiscard]] std::vector<ImuSample> samples_since(Stamp last, Stamp now) const;
  [[nodiscard]] bool takes_over(const TrackerStatistics& tracking, double gap_s) const;
  [[nodiscard]] Eigen::Matrix3d turn(const std::vector<ImuSample>& samples, Stamp from,
                                     Stamp to) const;
  [[nodiscard]] bool can_continue_at(const Held& held) const;
  void continue_at(const Held& held, VioResult& result);
  void start_on(const Held& held, const OdometryState& state, const StateCovariance& covariance);
  void try_start(VioResult& result);
  void advance(const Held& held, VioResult& result);
  void end_window();
  void restart(Held held);
  [[nodiscard]] bool has_recovered(const StereoFrame& frame) const;
  void discard_prior(const Held& held, const OdometryState& state);
  [[nodiscard]] bool is_lost(Stamp now, const SmootherUpdate& update);
  void watch_vision(Stamp stamp, int features, VioResult& result);
  [[nodiscard]] bool plausible(const SmootherUpdate& update) const;
  [[nodiscard]] bool is_contradicted(const StereoFrame& frame, const TrackedFrame& tracked,
                                     const SmootherUpdate& update);
  void continue_from_last_pose(std::vector<OdometryState>& states) const;
  void continue_or_add_first_keyframe(VioResult& result);
  [[nodiscard]] double moved_s(Stamp stamp) const;
  [[nodiscard]] double unmeasured_s(Stamp stamp) const;
  void add_first_keyframe(const OdometryState& state, VioResult& result);
  void add_keyframe(const OdometryState& state, VioResult& result);
  void publish(KeyframeOdometry keyframe, const OdometryState& state, VioResult& result);
  [[nodiscard]] std::optional<StateCovariance> state_covariance_at(
      const OdometryState& state) const;
  [[nodiscard]] std::optional<UncertainCalibration> known_calibration() const;
  [[nodiscard]] std::optional<Vertical> vertical_at(const OdometryState& state) const;
  void locate(const OdometryState& state, const Frame& frame, VioResult& result);
  [[nodiscard]] bool locates_points(const StereoFrame& frame) const;
  [[nodiscard]] bool due(const OdometryState& state, const StereoFrame& frame) const;

  RobotId robot_;
  SensorRig rig_;
  MotionModel model_;
  double readout_s_;  // as stated, without the estimated correction
  FeatureTracker tracker_;
  LearnedSensors learned_;                    // for the next window
  std::optional<FixedLagSmoother> smoother_;  // nullopt while starting
  RestDetector rest_detector_;
  VisionWatch vision_;
  EstimateWatch estimate_watch_;
  // Time at which vision returned after a long loss; nullopt once the prior that was formed during
  // the loss is discarded.
  std::optional<Stamp> vision_back_since_;
  VioStatistics statistics_;
  std::vector<ImuSample> samples_;  // Samples from the last one before or at the last image on.
  std::optional<Stamp> last_image_;
  std::vector<Held> held_;    // Images held back; not empty while starting.
  bool in_gap_ = false;       // The inertial samples have a gap.
  Stamp seen_ = 0;            // Last image that determined the pose; without an inertial sensor.
  int unlocated_images_ = 0;  // Images in a row with many features and few located landmarks.
  std::optional<OdometryState> last_;  // Last published state.
  std::optional<KeyframeOdometry> last_keyframe_;
  double rested_s_ = 0.0;               // Rest since the last keyframe [s].
  SE3 T_chain_odom_ = SE3::Identity();  // From live odometry to the chain of published keyframes.
};

}  // namespace km
