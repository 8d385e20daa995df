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
  bool rests = false;  ///< The body stands still here.
  /// Cover the time since the frame before, where it was not spent at rest; those of the first only
  /// those after it need.
  std::vector<ImuSample> samples;
  bool is_bridged = false;       ///< With a gap in them: see InertialFrame.
  std::optional<ImuFactor> imu;  ///< From the frame before; none for the first.
  /// The state is that of the inertial sensor's instant state.stamp + offset_s.
  double offset_s = 0.0;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();  ///< Measured there [rad/s].

  [[nodiscard]] Stamp instant() const { return state.stamp + nanoseconds(offset_s); }
};

/// Bearings of one landmark in one frame of the window.
struct WindowObservation {
  std::size_t frame = 0;                                   ///< Index into Window::frames.
  std::array<std::optional<Eigen::Vector2d>, 2> bearings;  ///< Left, right.
};

struct WindowLandmark {
  std::uint64_t id = 0;
  Eigen::Vector3d p_odom = Eigen::Vector3d::Zero();
  bool located = false;                         ///< p_odom is known: the landmark takes part.
  std::vector<WindowObservation> observations;  ///< Ascending frames.
};

/// Everything that the optimisation works on.
struct Window {
  std::array<ViewModel, 2> rig_views;  ///< As the rig says.
  std::array<ViewModel, 2> views;      ///< As the calibration says.
  CameraCalibration calibration;
  bool calibrates = false;  ///< The calibration is one of the unknowns.
  double gravity_mps2 = 9.81;
  double loss_scale = 1.5;  ///< Of the Cauchy loss on reprojection errors [standard deviations].
  std::vector<WindowFrame> frames;        ///< In order of time.
  std::vector<WindowLandmark> landmarks;  ///< Ascending ids.
  StatePrior prior;
};

/// Index of the frame with `id`; frames.size() if there is none.
[[nodiscard]] std::size_t frame_index(const Window& window, std::uint64_t id);

/// For each frame what the prior holds of it.
[[nodiscard]] std::vector<FirstEstimate> first_estimates(const Window& window);

/// Sets the calibration, and the views by it.
void calibrate(Window& window, const CameraCalibration& calibration);

/// Where the body was when the image of `frame` was taken, if `state` was its state.
[[nodiscard]] ImagePose image_pose(const Window& window, const WindowFrame& frame,
                                   const OdometryState& state);

/// The same for all frames by their states, without derivatives.
[[nodiscard]] std::vector<SE3> image_poses(const Window& window);

/// Enters what was seen in the window's last frame: known landmarks gain an observation, new ones
/// are added, not located yet.
void observe(Window& window, const TrackedFrame& tracked);

/// True if the landmark was seen in the last frame.
[[nodiscard]] bool tracked_now(const Window& window, const WindowLandmark& landmark);

/// Sets landmark.p_odom and `located` from its observations and image_poses(window): the point
/// nearest to all rays, refined on the reprojection errors (Gauss-Newton). It stays unlocated if
/// it comes to lie behind a camera, if an error exceeds `max_error` [standard deviations, root mean
/// square], or if its distance along the last ray is uncertain by more than a third.
void locate(const Window& window, std::span<const SE3> images, double max_error,
            WindowLandmark& landmark);

}  // namespace km
