#pragma once

#include <optional>
#include <span>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/covariance.hpp"
#include "modules/vio/gyro_noise_scale.hpp"
#include "modules/vio/tracked_frame.hpp"
#include "modules/vio/vio_config.hpp"
#include "modules/vio/window.hpp"
#include "modules/vio/window_optimizer.hpp"

namespace km {

/// An image as it enters the smoother: its features and the inertial samples that cover the time
/// since the image before.
struct InertialFrame {
  TrackedFrame tracked;
  std::vector<ImuSample> samples;
  bool is_bridged = false;  ///< Between some samples nobody knows what was.
};

/// What one image did to the smoother.
struct SmootherUpdate {
  OdometryState state;  ///< Of the newest image.
  bool keyframe = false;
  int landmarks = 0;  ///< That took part.
  int seen = 0;       ///< Of them in this image.
  int outliers = 0;   ///< Observations dropped.
  WindowSolution solution;
};

/// Fixed-lag smoother over the poses, velocities, biases and landmarks of a few keyframes and the
/// most recent images.
///
/// The window slides in two ways. An image that is not a keyframe and no longer recent is taken out
/// with its observations, and the inertial factors on its two sides become one, integrated anew.
/// While the body rests, only images are taken out: the first one at rest is a keyframe, that and
/// the most recent ones are joined by ImuFactor::at_rest(), and the rest of the window waits. So
/// however long it stands, the pose is measured from the same keyframes.
/// The oldest keyframe is marginalised: its inertial factor, the prior, and the landmarks that it
/// has seen are replaced by a prior on the rest (marginalize_oldest()). Derivatives by states in
/// the prior are first estimates. To keep tracked landmarks, dropping only the oldest keyframe's
/// observations (as OKVIS does), was measured to be worse: rotation errs by 0.24 instead of 0.16
/// degrees over 1 s on MH_01_easy from 9.9 s on. Deterministic; not thread-safe.
class FixedLagSmoother {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  FixedLagSmoother(const SensorRig& rig, const VioConfig& config);

  /// Starts from guessed states of consecutive images, one for each of `frames`; what was before is
  /// forgotten. The first position and heading are held, the biases weakly kept at their guess.
  /// Returns the refined states, or nullopt if the optimisation failed or the samples between two
  /// images make no inertial factor.
  [[nodiscard]] std::optional<std::vector<OdometryState>> start(
      std::span<const InertialFrame> frames, std::span<const OdometryState> guess);

  /// Starts on one image, from its state as estimated earlier: heading and position are held, the
  /// rest is kept as well as `covariance`, positive definite, says. What was before is forgotten.
  /// The state is that of the instant by the calibration known; where that lies before the image,
  /// frame.samples should begin by then.
  void start(const InertialFrame& frame, const OdometryState& state,
             const StateCovariance& covariance);

  /// What an earlier process knew of the calibration takes the place of the prior, where that is
  /// possible and it is estimated at all. Call before start().
  void recall(const UncertainCalibration& known);

  /// Adds the next image; `rests`: the body stands still. Precondition: start() succeeded. Where
  /// frame.samples do not cover the time since the image before or make no inertial factor, the
  /// solution is not usable, and only start() may follow.
  [[nodiscard]] SmootherUpdate add(const InertialFrame& frame, bool rests = false);

  /// States now in the window, in order of time.
  [[nodiscard]] const Window& window() const { return window_; }

  /// The current estimate at an image in the window; null if it is not there.
  [[nodiscard]] const WindowFrame* frame_at(Stamp stamp) const;

  /// The current estimate of the relative pose of two images in the window with its marginal
  /// covariance; nullopt if one has left or the information is singular.
  [[nodiscard]] std::optional<UncertainPose> relative_pose(Stamp from, Stamp to) const;

  /// Of the state at an image in the window; nullopt if it has left or the information is singular.
  [[nodiscard]] std::optional<StateCovariance> state_covariance(Stamp stamp) const;

  /// The current estimate with its marginal covariance; what the rig says if it is not estimated.
  [[nodiscard]] UncertainCalibration calibration() const;

  /// Of the gyroscope, beyond VioConfig::gyro_noise_factor.
  [[nodiscard]] double gyro_noise_scale() const { return gyro_noise_.scale(); }

  /// True if the image at `stamp` will not be in the window any more after the next add().
  [[nodiscard]] bool leaving(Stamp stamp) const;

 private:
  // These are false where an inertial factor cannot be made. The state is taken by value: it may be
  // the window's.
  [[nodiscard]] bool append(const InertialFrame& frame, OdometryState state, double offset_s);
  [[nodiscard]] bool slide(bool rests);
  [[nodiscard]] bool merge_out(std::size_t frame);
  void rest_out(std::size_t frame);
  [[nodiscard]] bool share_samples();
  [[nodiscard]] bool set_imu(std::size_t frame);
  void compare_gyro();
  void decide_keyframe();
  int reject_outliers();
  void locate_landmarks();
  void clear();
  void hold_first();
  void hold_calibration();
  [[nodiscard]] double first_offset_s(const InertialFrame& frame) const;
  [[nodiscard]] double next_offset_s(const InertialFrame& frame) const;
  [[nodiscard]] Matrix7 calibration_prior() const;
  [[nodiscard]] Eigen::Index variables() const;
  // Of D times the error of all frames, from its transpose.
  [[nodiscard]] std::optional<Eigen::MatrixXd> covariance_of(Eigen::MatrixXd D_T) const;
  [[nodiscard]] std::size_t keyframes() const;

  VioConfig config_;
  ImuNoise noise_;
  GyroNoiseScale gyro_noise_;
  double focal_px_;
  Eigen::Matrix3d R_cam_body_;
  Window window_;
  Matrix7 calibration_covariance_;  // As known when the window was started.
  std::uint64_t next_id_ = 0;
};

}  // namespace km
