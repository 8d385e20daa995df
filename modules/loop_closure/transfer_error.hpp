#pragma once

#include <Eigen/Core>

#include "modules/core/geometry.hpp"
#include "modules/core/keyframe.hpp"

namespace km {

/// Standard deviations of what a keyframe measures, at the finest level of the pyramid.
struct ImageNoise {
  double keypoint_px = 1.0;   ///< Position in the image; grows by 1.2 with each octave.
  double disparity_px = 0.5;  ///< Stereo disparity at the keyframe's focal length.
};

/// A keypoint as a measurement: m = (x, y, rho) with the bearing (x, y) on z = 1 and rho the
/// inverse depth [1/m]. Stereo noise is Gaussian in m, whatever the depth, unlike in the point.
struct ImagePoint {
  Eigen::Vector3d m = Eigen::Vector3d::Zero();
  Eigen::Vector3d variance = Eigen::Vector3d::Ones();  ///< Of the entries of m, independent.
  bool has_depth = false;

  /// Precondition: has_depth.
  [[nodiscard]] Eigen::Vector3d point() const {
    return {m.x() / m.z(), m.y() / m.z(), 1.0 / m.z()};
  }
};

[[nodiscard]] ImagePoint image_point(const KeyframeFeatures& features, std::size_t index,
                                     const ImageNoise& noise);

/// A point of keyframe a, carried into keyframe b by T_b_a, against what b measured.
///
/// The homogeneous point (x, y, 1, rho) maps to h = R (x, y, 1) + rho t, which is the measurement
/// (h_x / h_z, h_y / h_z, rho / h_z) in b: no division by the depth in a, so that points far away
/// are as harmless as near ones. `Sigma` is the covariance of r to first order from the noise of
/// BOTH points: minimising chi2 is maximum likelihood over the pose and the true points. If b has
/// no depth the third entry is absent: zero residual, zero rows.
struct TransferError {
  bool in_front = false;                        ///< False: behind camera b, the rest is unset.
  int dim = 0;                                  ///< 3 with depth on both sides, 2 if only a has it.
  Eigen::Vector3d r = Eigen::Vector3d::Zero();  ///< Predicted minus measured.
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  double chi2 = 0.0;
  Eigen::Vector3d likely = Eigen::Vector3d::Zero();  ///< True m of a that fits both sides best.
};

/// Precondition: a.has_depth.
[[nodiscard]] TransferError transfer_error(const SE3& T_b_a, const ImagePoint& a,
                                           const ImagePoint& b);

/// The same with the map linearised about `m` in place of a's measurement: what to minimise over
/// the pose with m = transfer_error(T_b_a, a, b).likely. About the measurement itself, its noise is
/// in the residual and in the derivative alike, and the pose is drawn towards no motion, by the
/// relative variance of the disparities ("attenuation", Fuller, "Measurement Error Models", 1987).
[[nodiscard]] TransferError transfer_error(const SE3& T_b_a, const ImagePoint& a,
                                           const ImagePoint& b, const Eigen::Vector3d& m);

/// Derivative of the point m = (x, y, rho) of a, carried into b, with respect to xi in
/// T_a_b * exp(xi). Precondition: in front.
[[nodiscard]] Eigen::Matrix<double, 3, 6> transfer_jacobian(const SE3& T_b_a,
                                                            const Eigen::Vector3d& m);

}  // namespace km
