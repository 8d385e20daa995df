#pragma once

#include <random>

#include "modules/core/geometry/geometry.hpp"

namespace km {

/// Vector with independent standard normal entries.
template <int N>
Eigen::Matrix<double, N, 1> random_vector(std::mt19937& rng) {
  std::normal_distribution<double> normal;
  Eigen::Matrix<double, N, 1> v;
  for (double& c : v) c = normal(rng);
  return v;
}

/// Pose with a uniform rotation and a translation uniform in [-extent_m, extent_m]^3.
inline SE3 random_pose(std::mt19937& rng, double extent_m = 10.0) {
  std::uniform_real_distribution<double> metres(-extent_m, extent_m);
  Eigen::Quaterniond q;
  q.coeffs() = random_vector<4>(rng).normalized();
  Eigen::Vector3d t;
  for (double& c : t) c = metres(rng);
  return make_pose(q.toRotationMatrix(), t);
}

/// Random positive definite matrix with standard deviations around `sigma`.
inline Matrix6 random_covariance(std::mt19937& rng, double sigma) {
  Matrix6 A;
  for (int c = 0; c < 6; ++c) A.col(c) = random_vector<6>(rng);
  return sigma * sigma * (A * A.transpose() / 6.0 + 0.1 * Matrix6::Identity());
}

}  // namespace km
