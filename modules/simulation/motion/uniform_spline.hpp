#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace km {

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

}  // namespace km
