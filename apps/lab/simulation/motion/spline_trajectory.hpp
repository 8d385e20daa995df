#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "modules/core/geometry/geometry.hpp"

namespace km {

inline constexpr double kGravity_mps2 = 9.81;  ///< Gravity of all simulated worlds.

/// The six weights of a uniform B-spline of degree 5 within one of its intervals.
struct QuinticBasis {
  static constexpr std::size_t kOrder = 6;
  using Weights = Eigen::Matrix<double, 6, 1>;

  Weights value;   ///< They sum to 1 and are not negative: the curve stays in its controls' hull.
  Weights first;   ///< d/du
  Weights second;  ///< d^2/du^2

  /// At `u` in [0, 1] of the way between the third and the fourth of the six controls
  /// (the Cox-de Boor recurrence on equidistant knots, multiplied out).
  [[nodiscard]] static QuinticBasis at(double u);
};

/// A curve in R^N, a uniform B-spline of degree 5: four times continuously differentiable.
template <int N>
class UniformSpline {
 public:
  using Vector = Eigen::Matrix<double, N, 1>;

  struct Sample {
    Vector value, first, second;  ///< And the derivatives by x.
  };

  /// Defined over [start, end()]; at `start` nearest to control 2. Preconditions: at least 6
  /// controls, interval > 0.
  UniformSpline(double start, double interval, std::vector<Vector> controls)
      : start_(start), interval_(interval), controls_(std::move(controls)) {}

  [[nodiscard]] double start() const { return start_; }
  [[nodiscard]] double end() const {
    return start_ + interval_ * static_cast<double>(controls_.size() - QuinticBasis::kOrder + 1);
  }

  /// At `x`, moved into [start, end()] if it is outside. O(1).
  [[nodiscard]] Sample at(double x) const {
    const double position = (std::clamp(x, start_, end()) - start_) / interval_;
    const std::size_t first =
        std::min(static_cast<std::size_t>(position), controls_.size() - QuinticBasis::kOrder);
    const QuinticBasis basis = QuinticBasis::at(position - static_cast<double>(first));
    Sample sample{Vector::Zero(), Vector::Zero(), Vector::Zero()};
    for (std::size_t k = 0; k < QuinticBasis::kOrder; ++k) {
      const Vector& control = controls_[first + k];
      const auto row = static_cast<Eigen::Index>(k);
      sample.value += basis.value[row] * control;
      sample.first += basis.first[row] * control;
      sample.second += basis.second[row] * control;
    }
    sample.first /= interval_;
    sample.second /= interval_ * interval_;
    return sample;
  }

 private:
  double start_;
  double interval_;
  std::vector<Vector> controls_;
};

/// A uniform B-spline of degree 5 to be fitted, in units of its interval: control k has most weight
/// at position k - 2, the curve covers [0, controls - 5].
struct SplineFitOptions {
  std::size_t controls = 0;
  double noise = 1.0;      ///< Standard deviation of the values.
  double roughness = 1.0;  ///< Standard deviation of third differences of successive controls.
};

/// Controls (one row each) of the curve through `values` (one row per position) that minimises
///   sum rho(|values - curve|^2 / noise^2) + sum |third differences of controls|^2 / roughness^2,
/// with Cauchy's rho, by reweighted least squares, so that outliers lose weight. Positions ascend
/// within the curve. The band of the normal equations has width 6: O(values + controls).
[[nodiscard]] Eigen::MatrixXd fit_spline(std::span<const double> positions,
                                         const Eigen::MatrixXd& values,
                                         const SplineFitOptions& options);

/// Motion of a body at one instant.
struct BodyMotion {
  SE3 T_world_body = SE3::Identity();
  Eigen::Vector3d velocity_world = Eigen::Vector3d::Zero();         ///< [m/s]
  Eigen::Vector3d acceleration_world = Eigen::Vector3d::Zero();     ///< Without gravity [m/s^2].
  Eigen::Vector3d angular_velocity_body = Eigen::Vector3d::Zero();  ///< [rad/s]
};

/// A rigid motion, twice differentiable in time. Immutable, safe to use from several threads.
class BodyTrajectory {
 public:
  virtual ~BodyTrajectory() = default;
  [[nodiscard]] virtual double start_s() const = 0;
  [[nodiscard]] virtual double end_s() const = 0;

  /// Exact derivatives of one curve. `t_s` within [start_s, end_s], else std::out_of_range.
  [[nodiscard]] virtual BodyMotion motion(double t_s) const = 0;
};

/// A rigid motion as one B-spline of degree 5: of the position, and of the quaternion as a curve s
/// in R^4 that is normalised where it is evaluated. The angular velocity is exactly
/// 2 vec(conj(s) s') / |s|^2: what normalising adds to s' lies along s and has no vector part.
///
/// Chosen over the cumulative B-spline on SO(3) (Sommer et al., "Efficient Derivative Computation
/// for Cumulative B-Splines on Lie Groups", CVPR 2020) because it is linear in its controls: curves
/// are fitted by linear least squares. A rotation of the world or the body rotates the curve in the
/// same way, since both act on R^4 as rotations. Between controls that are far apart the rate is
/// less even than there. At the few degrees used here the difference is negligible.
class SplineTrajectory final : public BodyTrajectory {
 public:
  /// Position [m] and a quaternion (x, y, z, w) of about unit length and any sign.
  using Control = Eigen::Matrix<double, 7, 1>;

  /// The curve over [start_s, start_s + (controls - 5) * interval_s], at `start_s` nearest to
  /// control 2. Equal controls give a body at rest. Preconditions: at least 6 controls,
  /// neighbouring rotations at most 90 degrees apart.
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
/// at its end near the last but two. Motion faster than two or three intervals is smoothed.
[[nodiscard]] SplineTrajectory spline_along(double start_s, double interval_s,
                                            std::span<const SE3> poses);

}  // namespace km
