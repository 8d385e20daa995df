#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/camera/camera_calibration.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/vio/residuals.hpp"
#include "modules/vio/tracked_frame.hpp"

namespace km {

/// Pose of the body when an image was taken, for a state of the body `shift_s` before, with its
/// derivatives. In between, the body keeps the velocity and angular rate of the state. Derivatives
/// by velocity and gyro bias, which are proportional to `shift_s`, are omitted.
struct ImagePose {
  SE3 T_odom_body = SE3::Identity();
  /// Derivative of the rotation by that of the state, and of the translation by that of the state.
  Eigen::Matrix3d by_state = Eigen::Matrix3d::Identity();
  /// Derivative by the delta of CameraCalibration::retracted(), except for the readout time, which
  /// does not move the image. The images cannot distinguish a
  /// motion of the cameras relative to the body from the same motion of the body. The derivative by
  /// the mounting is therefore that by the pose itself, the identity.
  Eigen::Matrix<double, 6, 7> by_calibration;

  /// `gyro`: angular rate that the gyroscope measures at the state [rad/s].
  [[nodiscard]] static ImagePose at(const OdometryState& state, const Eigen::Vector3d& gyro,
                                    double shift_s);
};

/// Quadratic cost 1/2 |J dx + r|^2.
struct SquareRootPrior {
  Eigen::MatrixXd J;
  Eigen::VectorXd r;
};

/// Eliminates the first `count` variables of the quadratic 1/2 dx^T H dx + g^T dx by their Schur
/// complement. Returns the marginal on the other variables in square-root form: J^T J and J^T r are
/// the marginal H and g. Directions without information (below 1e-12 of the largest, after scaling
/// the diagonal to one) get no rows. H symmetric, positive semi-definite; 0 <= count <= size. Cubic
/// in the size. The method is that of OKVIS (Leutenegger et al., IJRR 2015, Sec. 4.3) and VINS-Mono
/// (Qin et al., TRO 2018, Sec. VI-D).
[[nodiscard]] SquareRootPrior marginalize(const Eigen::MatrixXd& H, const Eigen::VectorXd& g,
                                          Eigen::Index count);

/// Prior of marginalised states on the oldest states of a window, a square-root prior on dx =
/// [pose_0 (6), motion_0 (9), pose_1 (6), pose_2 (6), ..., calibration (8)]. dx are the retracted
/// differences to `linearization` and `calibration`. Only the first state has its velocity and
/// biases in dx. The calibration is in dx only if `calibrates`.
struct StatePrior {
  std::vector<std::uint64_t> frames;         ///< Ids; equally long as linearization.
  std::vector<OdometryState> linearization;  ///< First estimates, at which the prior was made.
  CameraCalibration calibration;             ///< First estimate of the calibration.
  bool calibrates = false;
  Eigen::MatrixXd J;
  Eigen::VectorXd r;

  /// Dimension without the calibration.
  [[nodiscard]] Eigen::Index states_dimension() const {
    return frames.empty() ? 0 : 9 + 6 * static_cast<Eigen::Index>(frames.size());
  }
  [[nodiscard]] Eigen::Index dimension() const {
    return states_dimension() + (calibrates ? kCalibrationSize : 0);
  }
};

/// dx of StatePrior for the current `states`, one for each of prior.frames, and calibration.
[[nodiscard]] Eigen::VectorXd prior_offset(const StatePrior& prior,
                                           std::span<const OdometryState* const> states,
                                           const CameraCalibration& calibration = {});

/// A state of the smoother's window.
struct WindowFrame {
  std::uint64_t id = 0;  ///< Ascending along the window.
  OdometryState state;
  bool keyframe = false;
  bool rests = false;  ///< The body stands still in this image.
  int features = 0;    ///< Number of features in the image.
  /// Samples since the frame before, except for rests. The samples of the first frame are used only
  /// by the following frames.
  std::vector<ImuSample> samples;
  bool is_bridged = false;  ///< `samples` have a gap: see InertialFrame.
  /// Without an inertial sensor: this image or the next one shows no motion. See ShownMotion.
  bool is_smooth = false;
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
