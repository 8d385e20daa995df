#pragma once

#include <Eigen/Core>
#include <span>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/core/geometry/geometry.hpp"

namespace km {

using Matrix9 = Eigen::Matrix<double, 9, 9>;

/// Relative motion measured by the inertial sensor between two instants i and j, in the body frame
/// at i and without gravity and initial velocity (Forster et al., TRO 2017, Eq. (33)).
struct PreintegratedMotion {
  Eigen::Matrix3d dR = Eigen::Matrix3d::Identity();  ///< R_i_j.
  Eigen::Vector3d dv = Eigen::Vector3d::Zero();      ///< R_i^T (v_j - v_i - g dt) [m/s].
  Eigen::Vector3d dp = Eigen::Vector3d::Zero();      ///< R_i^T (p_j - p_i - v_i dt - g dt^2/2) [m].
};

/// On-manifold preintegration of inertial samples with first-order bias correction (Forster,
/// Carlone, Dellaert, Scaramuzza, "On-Manifold Preintegration for Real-Time Visual-Inertial
/// Odometry", TRO 2017, Sec. V and VI). motion() is Eq. (35) to (37), covariance() is Eq. (62) and
/// (63). corrected() is Eq. (44). Its derivatives accumulate sample by sample as in the paper's
/// appendix on bias correction.
///
/// Deviation: each step uses the mean of its two samples in the frame half-way through the step.
/// The integration is therefore of second order in the sampling period. The zero-order hold of the
/// paper is of first order.
class ImuPreintegration {
 public:
  /// Starts at an instant with the biases to integrate with [rad/s], [m/s^2].
  ImuPreintegration(const ImuNoise& noise, const Eigen::Vector3d& gyro_bias,
                    const Eigen::Vector3d& accel_bias);

  /// Appends the time from `begin.stamp` to `end.stamp`. Precondition: end is later, values finite.
  void add(const ImuSample& begin, const ImuSample& end);

  /// Appends the time from `from` to `to`, interpolating samples at both borders. False, and no
  /// change, if `samples` do not cover [from, to]. Precondition: `samples` ascend.
  [[nodiscard]] bool add(std::span<const ImuSample> samples, Stamp from, Stamp to);

  [[nodiscard]] double dt_s() const { return dt_s_; }
  [[nodiscard]] const ImuNoise& noise() const { return noise_; }
  [[nodiscard]] const Eigen::Vector3d& gyro_bias() const { return gyro_bias_; }
  [[nodiscard]] const Eigen::Vector3d& accel_bias() const { return accel_bias_; }
  [[nodiscard]] const PreintegratedMotion& motion() const { return motion_; }

  /// motion() for other biases, to first order in their change.
  [[nodiscard]] PreintegratedMotion corrected(const Eigen::Vector3d& gyro_bias,
                                              const Eigen::Vector3d& accel_bias) const;

  /// Covariance of [rotation; velocity; position] errors, the rotation as dR * exp(error).
  [[nodiscard]] const Matrix9& covariance() const { return covariance_; }

  // Derivatives of motion() by the biases, the rotation's on its right.
  [[nodiscard]] const Eigen::Matrix3d& dR_dbg() const { return dR_dbg_; }
  [[nodiscard]] const Eigen::Matrix3d& dv_dbg() const { return dv_dbg_; }
  [[nodiscard]] const Eigen::Matrix3d& dv_dba() const { return dv_dba_; }
  [[nodiscard]] const Eigen::Matrix3d& dp_dbg() const { return dp_dbg_; }
  [[nodiscard]] const Eigen::Matrix3d& dp_dba() const { return dp_dba_; }

 private:
  ImuNoise noise_;
  Eigen::Vector3d gyro_bias_, accel_bias_;
  double dt_s_ = 0.0;
  PreintegratedMotion motion_;
  Matrix9 covariance_ = Matrix9::Zero();
  Eigen::Matrix3d dR_dbg_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d dv_dbg_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d dv_dba_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d dp_dbg_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d dp_dba_ = Eigen::Matrix3d::Zero();
};

/// The state dt_s() after `state` by its biases and `imu`; gravity is [0, 0, -gravity_mps2].
/// The stamp does not change. Forster et al., TRO 2017, Eq. (38) without noise, for state j.
[[nodiscard]] OdometryState predict(const OdometryState& state, const ImuPreintegration& imu,
                                    double gravity_mps2);

}  // namespace km
