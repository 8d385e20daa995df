#pragma once

#include <optional>

#include "modules/core/camera/camera.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/vio/preintegration.hpp"

namespace km {

/// A camera of the rig in the form that the residuals use.
struct ViewModel {
  Eigen::Matrix3d R_cam_body = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t_cam_body = Eigen::Vector3d::Zero();
  double weight = 1.0;  ///< Focal length over pixel noise: bearing errors to standard deviations.
};

[[nodiscard]] ViewModel view_model(const Camera& camera, double noise_px);

/// A linearised reprojection error in standard deviations. The pose's tangent is [rotation;
/// translation], see retract().
struct ReprojectionTerm {
  Eigen::Vector2d r;
  Eigen::Matrix<double, 2, 6> J_pose;
  Eigen::Matrix<double, 2, 3> J_point;
};

/// Landmarks nearer than this in front of a camera have no residual [m].
inline constexpr double kMinDepth_m = 0.05;

/// weight * (pi(T_cam_body T_odom_body^-1 p_odom) - bearing) with pi(p) = [x/z, y/z]; false if the
/// landmark is not in front of the camera.
[[nodiscard]] bool reprojection_error(const ViewModel& view, const Eigen::Vector2d& bearing,
                                      const SE3& T_odom_body, const Eigen::Vector3d& p_odom,
                                      Eigen::Vector2d& r);

/// reprojection_error() at T_odom_body, with derivatives at `T_linearization`: first-estimate
/// Jacobians (Huang, Mourikis, Roumeliotis, ISER 2008). If no prior holds this pose, pass
/// T_odom_body twice.
[[nodiscard]] bool linearize_reprojection(const ViewModel& view, const Eigen::Vector2d& bearing,
                                          const SE3& T_odom_body, const SE3& T_linearization,
                                          const Eigen::Vector3d& p_odom, ReprojectionTerm& term);

using Vector15 = Eigen::Matrix<double, 15, 1>;
using Matrix15 = Eigen::Matrix<double, 15, 15>;

/// The linearised inertial error between states i and j, whitened. Rows: rotation, velocity,
/// position, gyro bias, accelerometer bias. Columns of each state: rotation, translation (see
/// retract()), velocity, gyro bias, accelerometer bias.
struct ImuTerm {
  Vector15 r;
  Matrix15 J_i;
  Matrix15 J_j;
};

/// Parts of a state that a prior holds, at the values of their first linearisation.
struct FirstEstimate {
  std::optional<SE3> pose;
  std::optional<OdometryState> motion;  ///< Velocity and biases; the pose is not used.

  /// `state` with these parts replaced.
  [[nodiscard]] OdometryState applied_to(const OdometryState& state) const;
};

/// Preintegrated inertial factor between two states (Forster et al., TRO 2017, Sec. VI-D: residuals
/// Eq. (45), their derivatives Eq. (71) to (81)) together with the random walk of both biases
/// (Sec. VI-E, Eq. (47) and (48)).
class ImuFactor {
 public:
  /// nullopt if `imu` cannot be whitened: it is empty, or its covariance is not positive definite
  /// to the digits of a double.
  [[nodiscard]] static std::optional<ImuFactor> of(const ImuPreintegration& imu,
                                                   double gravity_mps2);

  /// Factor between two instants of one rest, `dt_s` apart, in place of samples. Pose and velocity
  /// are equal within the tolerance of RestDetector, and the biases walk by `noise`. imu() is
  /// empty. Precondition: dt_s > 0.
  [[nodiscard]] static ImuFactor at_rest(const ImuNoise& noise, double dt_s);

  [[nodiscard]] const ImuPreintegration& imu() const { return imu_; }

  /// True for at_rest().
  [[nodiscard]] bool rests() const { return !(imu_.dt_s() > 0.0); }

  /// Whitened error.
  [[nodiscard]] Vector15 error(const OdometryState& i, const OdometryState& j) const;

  /// error(i, j) with derivatives taken at `lin_i`, `lin_j` (first-estimate Jacobians; pass the
  /// states themselves otherwise).
  [[nodiscard]] ImuTerm linearize(const OdometryState& i, const OdometryState& j,
                                  const OdometryState& lin_i, const OdometryState& lin_j) const;

 private:
  ImuFactor(const ImuPreintegration& imu, double gravity_mps2, const Matrix9& sqrt_information,
            double walk_s);

  ImuPreintegration imu_;
  Eigen::Vector3d gravity_odom_;
  Matrix9 sqrt_information_;
  double gyro_walk_weight_ = 0.0;
  double accel_walk_weight_ = 0.0;
};

}  // namespace km
