#pragma once

#include <Eigen/Core>

namespace km {

/// Central differences of `f`, a function of N numbers that returns a vector, about zero.
template <int N, typename Function>
[[nodiscard]] Eigen::MatrixXd numeric_jacobian(const Function& f) {
  using Step = Eigen::Matrix<double, N, 1>;
  constexpr double kStep = 1e-6;
  Eigen::MatrixXd J(f(Step::Zero().eval()).size(), N);
  for (int c = 0; c < N; ++c) {
    const Step step = kStep * Step::Unit(c);
    J.col(c) = (f(step) - f(-step)) / (2.0 * kStep);
  }
  return J;
}

}  // namespace km
