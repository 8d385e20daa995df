#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/camera_calibration.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/odometry.hpp"
#include "modules/vio/image_pose.hpp"
#include "modules/vio/marginalization.hpp"
#include "modules/vio/residuals.hpp"
#include "modules/vio/tracked_frame.hpp"

namespace km {

/// A state of the smoother's window.
struct WindowFrame {
  std::uint64_t id = 0;  ///< Ascending along the window.
  OdometryState state;
  bool keyframe = false;
  bool rests = false;  ///< The body stands still in this image.
  /// Samples since the frame before, except for rests. The samples of the first frame are used only
  /// by the following frames.
  std::vector<ImuSample> samples;
  bool is_bridged = false;       ///< `samples` have a gap: see InertialFrame.
  std::optional<ImuFactor> imu;  ///< Factor from the frame before; none for the first.
  /// The state belongs to the instant state.stamp + offset_s of the inertial sensor.
  double offset_s = 0.0;
  /// Angular rate measured at that instant [rad/s].
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();

  [[nodiscard]] Stamp instant() const { return state.stamp + nanoseconds(offset_s); }
};

/// Bearings of one landmark in one frame of the window.
struct WindowObservation {
  std::size_t frame = 0;  ///< Index into Window::frames.
  /// Left, right, at the stamp of the image: moved by the estimated readout time.
  std::array<std::optional<Eigen::Vector2d>, 2> bearings;
  /// See TrackedFeature::left_by_readout.
  std::array<Eigen::Vector2d, 2> by_readout = {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
};

struct WindowLandmark {
  std::uint64_t id = 0;
  Eigen::Vector3d p_odom = Eigen::Vector3d::Zero();
  bool located = false;  ///< p_odom is known, and the optimisation uses the landmark.
  std::vector<WindowObservation> observations;  ///< Ascending frames.
};

/// All variables and data of the optimisation.
struct Window {
  std::array<ViewModel, 2> rig_views;  ///< Cameras as the rig states them.
  std::array<ViewModel, 2> views;      ///< Cameras with the estimated calibration.
  CameraCalibration calibration;
  bool calibrates = false;  ///< The calibration is one of the unknowns.
  double gravity_mps2 = 9.81;
  /// Scale of the Cauchy loss on reprojection errors [standard deviations].
  double loss_scale = 1.5;
  std::vector<WindowFrame> frames;        ///< In order of time.
  std::vector<WindowLandmark> landmarks;  ///< Ascending ids.
  StatePrior prior;
};

/// Index of the frame with `id`; frames.size() if there is none.
[[nodiscard]] std::size_t frame_index(const Window& window, std::uint64_t id);

/// First estimates held by the prior, one entry for each frame.
[[nodiscard]] std::vector<FirstEstimate> first_estimates(const Window& window);

/// Sets the calibration, and updates the views and the bearings of all observations.
void calibrate(Window& window, const CameraCalibration& calibration);

/// Pose of the body when the image of `frame` was taken, for its state `state`.
[[nodiscard]] ImagePose image_pose(const Window& window, const WindowFrame& frame,
                                   const OdometryState& state);

/// image_pose() of all frames with their own states, without derivatives.
[[nodiscard]] std::vector<SE3> image_poses(const Window& window);

/// Adds the observations of the window's last frame. Known landmarks gain an observation; new ones
/// are added without a position.
void observe(Window& window, const TrackedFrame& tracked);

/// True if the landmark was seen in the last frame.
[[nodiscard]] bool tracked_now(const Window& window, const WindowLandmark& landmark);

/// Sets landmark.p_odom and `located` from its observations and image_poses(window). The position
/// is the point nearest to all rays, refined on the reprojection errors (Gauss-Newton). The
/// landmark stays unlocated if it lies behind a camera or if an error exceeds `max_error` [standard
/// deviations, root mean square]. It also stays unlocated if its distance along the last ray is
/// uncertain by more than a third.
void locate(const Window& window, std::span<const SE3> images, double max_error,
            WindowLandmark& landmark);

}  // namespace km
