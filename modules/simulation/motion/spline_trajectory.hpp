#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "modules/simulation/motion/body_trajectory.hpp"
#include "modules/simulation/motion/uniform_spline.hpp"

namespace km {

/// A rigid motion as one B-spline of degree 5: of the position, and of the quaternion as a curve s
/// in R^4 that is normalised where it is evaluated. The angular velocity is exactly
/// 2 vec(conj(s) s') / |s|^2: what normalising adds to s' lies along s and has no vector part.
///
/// Chosen over the cumulative B-spline on SO(3) (Sommer et al., "Efficient Derivative Computation
/// for Cumulative B-Splines on Lie Groups", CVPR 2020) because it is linear in its controls: curves
/// are fitted by linear least squares. Turning the world or the body turns the curve alike, since
/// both act on R^4 as rotations. The rate between controls is less even than there when they are
/// far apart, which at the few degrees met here is nothing.
class SplineTrajectory final : public BodyTrajectory {
 public:
  /// Position [m] and a quaternion (x, y, z, w) of about unit length and any sign.
  using Control = Eigen::Matrix<double, 7, 1>;

  /// The curve over [start_s, start_s + (controls - 5) * interval_s], at `start_s` nearest to
  /// control 2. Equal controls give a body at rest. Throws std::invalid_argument for fewer than 6
  /// controls, an interval that is not positive, values that are not finite, and neighbouring
  /// rotations more than 90 degrees apart.
  SplineTrajectory(double start_s, double interval_s, std::vector<Control> controls);

  [[nodiscard]] double start_s() const override { return curve_.start(); }
  [[nodiscard]] double end_s() const override { return curve_.end(); }
  [[nodiscard]] BodyMotion motion(double t_s) const override;

 private:
  UniformSpline<7> curve_;
};

/// The control at pose `T`.
[[nodiscard]] SplineTrajectory::Control spline_control(const SE3& T);

/// The trajectory whose controls are `poses`, one every `interval_s`: at its start near poses[2],
/// at its end near the last but two. It smooths what is faster than two or three intervals.
[[nodiscard]] SplineTrajectory spline_along(double start_s, double interval_s,
                                            std::span<const SE3> poses);

}  // namespace km
