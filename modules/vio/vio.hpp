#pragma once

#include <optional>
#include <span>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/odometry.hpp"
#include "modules/vio/feature_tracker.hpp"
#include "modules/vio/fixed_lag_smoother.hpp"
#include "modules/vio/initialization.hpp"
#include "modules/vio/rest_detector.hpp"
#include "modules/vio/vio_config.hpp"
#include "modules/vio/vio_statistics.hpp"
#include "modules/vio/vision_watch.hpp"

namespace km {

/// What kept a packet from being used in full. The first that applies.
enum class VioProblem {
  kNone,
  kNoImage,         ///< The packet has none that fit the rig: inertial samples are kept.
  kUnorderedImage,  ///< Not later than the image before: dropped.
  kBadSamples,      ///< Some inertial samples are implausible or not in order: those are dropped.
  /// Too long without inertial samples: the images alone tell the motion, or, where they do not, a
  /// new start from the last pose.
  kInertialGap,
  /// The estimate was impossible, or had no place for what is seen: a new start from the last pose.
  kDiverged,
  kStartTimeout,  ///< Could not start: the oldest images held back are given up, without a pose.
};

/// What came out of one packet.
struct VioResult {
  VioProblem problem = VioProblem::kNone;
  std::vector<OdometryState> states;        ///< In order of time; several at a start.
  std::vector<KeyframeOdometry> keyframes;  ///< New keyframes; several at a start.
  std::vector<LocatedFrame> frames;         ///< One for each state.
  std::optional<StartStatus> start;         ///< Outcome, if a start was attempted.
  TrackerStatistics tracking;               ///< Of this image.
  std::vector<Eigen::Vector2d> tracked;     ///< Its features: bearings in the left camera.
  std::optional<SmootherUpdate> smoother;   ///< Not before the start.
  std::optional<VisionEvent> vision;        ///< Lost, or back.
};

/// Where an earlier process of the robot left off: at a keyframe, whose image is the first that
/// comes again.
struct VioCheckpoint {
  OdometryState state;        ///< At the keyframe's image.
  KeyframeOdometry keyframe;  ///< The last that was handed on.
};

/// Stereo-inertial or RGB-D-inertial odometry: one call per image, a pose for every image.
///
/// Images of the first VioConfig::start_s are held back; then all their poses come at once, and
/// from there one pose per image. No keyframes come of a body that stands still (RestDetector), and
/// the next one is measured from the one before the rest. Bad input is refused and reported, an
/// estimate that diverges starts anew from the last pose; neither throws. Deterministic; not
/// thread-safe.
class Vio {
 public:
  /// Throws ConfigError, and std::invalid_argument for an unusable rig.
  Vio(RobotId robot, const SensorRig& rig, const TrackerConfig& tracker, const VioConfig& config);

  /// Goes on from there: the next keyframe follows that one, measured from it like any other where
  /// odometry starts on its image. Where that comes first and the covariance of the state is
  /// known, odometry starts on it at once, from that state; else like any start, with the images
  /// of VioConfig::start_s. What was known of the calibration stays known. Call before the first
  /// process().
  void continue_from(const VioCheckpoint& checkpoint);

  [[nodiscard]] VioResult process(const SensorPacket& packet);

  /// How the cameras stand to the inertial sensor, as known by now; see VioConfig::calibrate.
  [[nodiscard]] UncertainCalibration calibration() const { return smoother_.calibration(); }

  [[nodiscard]] const VioStatistics& statistics() const { return statistics_; }

 private:
  using Frame = std::shared_ptr<const StereoFrame>;
  struct Held {
    InertialFrame data;
    Frame frame;
  };

  int take_samples(const SensorPacket& packet);
  [[nodiscard]] std::vector<ImuSample> samples_since(Stamp last, Stamp now) const;
  [[nodiscard]] bool takes_over(const TrackerStatistics& tracking, double gap_s) const;
  [[nodiscard]] Eigen::Matrix3d turn(const std::vector<ImuSample>& samples, Stamp from,
                                     Stamp to) const;
  [[nodiscard]] bool goes_on_at(const Held& held) const;
  void go_on(const Held& held, VioResult& result);
  void start_on(const Held& held, const OdometryState& state, const StateCovariance& covariance);
  void try_start(VioResult& result);
  void advance(const Held& held, VioResult& result);
  void restart(Held held);
  [[nodiscard]] bool has_mended(const StereoFrame& frame) const;
  void forget_dark(const Held& held, const OdometryState& state);
  void watch_vision(Stamp stamp, int features, VioResult& result);
  [[nodiscard]] bool plausible(const SmootherUpdate& update) const;
  void continue_from_last_pose(std::vector<OdometryState>& states) const;
  void take_up_or_hand_on_first(VioResult& result);
  [[nodiscard]] double moved_s(Stamp stamp) const;
  [[nodiscard]] double unseen_s(Stamp stamp) const;
  void hand_on_first(const OdometryState& state, VioResult& result);
  void hand_on(const OdometryState& state, VioResult& result);
  [[nodiscard]] std::optional<StateCovariance> state_covariance_at(
      const OdometryState& state) const;
  [[nodiscard]] std::optional<UncertainCalibration> known_calibration() const;
  [[nodiscard]] std::optional<Vertical> vertical_at(const OdometryState& state) const;
  void locate(const OdometryState& state, const Frame& frame, VioResult& result);
  [[nodiscard]] bool locates_points(const StereoFrame& frame) const;
  [[nodiscard]] bool due(const OdometryState& state, const StereoFrame& frame) const;

  RobotId robot_;
  SensorRig rig_;
  VioConfig config_;
  FeatureTracker tracker_;
  FixedLagSmoother smoother_;
  RestDetector rest_detector_;
  VisionWatch vision_;
  std::optional<Stamp> back_since_;  // Vision; until what came before is forgotten.
  VioStatistics statistics_;
  std::vector<ImuSample> samples_;  // From the last one not after the last image on.
  std::optional<Stamp> last_image_;
  std::vector<Held> held_;  // Not empty: starting.
  bool running_ = false;
  bool in_gap_ = false;                // of the inertial samples
  int unlocated_images_ = 0;           // In a row: with many features and hardly a landmark.
  std::optional<OdometryState> last_;  // Last state that was given out.
  std::optional<KeyframeOdometry> last_keyframe_;
  double rested_s_ = 0.0;               // Since then.
  SE3 T_chain_odom_ = SE3::Identity();  // From live odometry to the chain of keyframes.
};

}  // namespace km
