#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "modules/simulation/motion/body_trajectory.hpp"

namespace km {

/// Uniform B-spline of degree 5 (order 6): four times continuously differentiable.
struct QuinticBasis {
  static constexpr std::size_t kOrder = 6;
  using Weights = Eigen::Matrix<double, kOrder, 1>;

  Weights value;   ///< Of six successive controls; they sum to 1.
  Weights first;   ///< d/du
  Weights second;  ///< d^2/du^2

  /// At `u` in [0, 1] of the span between the third and the fourth of its controls
  /// (de Boor, "A Practical Guide to Splines", Ch. X: the recurrence on equidistant knots).
  [[nodiscard]] static QuinticBasis at(double u);
};

/// A rigid motion as one B-spline of degree 5: of the position, and of the quaternion as a curve in
/// R^4 that is normalised where it is evaluated. Both are linear in their controls, so that curves
/// can be fitted by linear least squares, and rotating all controls rotates the curve. With s(t)
/// the curve in R^4, the angular velocity is exactly 2 vec(s* s') / |s|^2: what the normalisation
/// adds to s' is along s and has no vector part.
///
/// Chosen over the cumulative B-spline on SO(3) (Sommer et al., CVPR 2020) for the linear fit. Its
/// price: the rate between far-apart controls is less even, nothing at the few degrees met here.
class SplineTrajectory final : public BodyTrajectory {
 public:
  static constexpr std::size_t kMinControls = QuinticBasis::kOrder;

  /// A control: position and a quaternion (x, y, z, w) of any sign and about unit length.
  using Control = Eigen::Matrix<double, 7, 1>;

  /// The curve over [start_s, start_s + (controls - 5) * interval_s]; near the k-th interval's
  /// start it is nearest to control k + 2. Equal controls give a body at rest. Throws
  /// std::invalid_argument for fewer than 6 controls, an interval that is not positive, values that
  /// are not finite, and neighbouring quaternions 90 degrees or more apart.
  SplineTrajectory(double start_s, double interval_s, std::vector<Control> controls);

  [[nodiscard]] double start_s() const override { return start_s_; }
  [[nodiscard]] double end_s() const override;
  [[nodiscard]] BodyMotion motion(double t_s) const override;

 private:
  double start_s_ = 0.0;
  double interval_s_ = 0.0;
  std::vector<Control> controls_;
};

/// The control at pose `T`.
[[nodiscard]] SplineTrajectory::Control spline_control(const SE3& T);

/// The trajectory whose controls are `poses`, one every `interval_s`, poses[0] near `start_s`. The
/// two missing at either end repeat the pose there. The curve smooths what is faster than about two
/// intervals.
[[nodiscard]] SplineTrajectory spline_along(double start_s, double interval_s,
                                            std::span<const SE3> poses);

}  // namespace km
