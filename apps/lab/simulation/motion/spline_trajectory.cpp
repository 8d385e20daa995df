#include "apps/lab/simulation/motion/spline_trajectory.hpp"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <array>
#include <stdexcept>
#include <string>

namespace km {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Row k: coefficients of weight k by powers of u.
const Matrix6d& coefficients() {
  static const Matrix6d matrix = [] {
    Matrix6d M;
    M << 1, -5, 10, -10, 5, -1,    //
        26, -50, 20, 20, -20, 5,   //
        66, 0, -60, 0, 30, -10,    //
        26, 50, 20, -20, -20, 10,  //
        1, 5, 10, 10, 5, -5,       //
        0, 0, 0, 0, 0, 1;
    return Matrix6d(M / 120.0);
  }();
  return matrix;
}

using SparseMatrix = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

constexpr int kReweightings = 5;
constexpr double kOutlier = 3.0;  // residual that halves a weight, in standard deviations

// Row i: the weights of the controls in the curve's value at positions[i].
SparseMatrix curve_matrix(std::span<const double> positions, std::size_t controls) {
  Triplets triplets;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const std::size_t first =
        std::min(static_cast<std::size_t>(positions[i]), controls - QuinticBasis::kOrder);
    const auto weights = QuinticBasis::at(positions[i] - static_cast<double>(first)).value;
    for (std::size_t k = 0; k < QuinticBasis::kOrder; ++k)
      triplets.emplace_back(static_cast<int>(i), static_cast<int>(first + k),
                            weights[static_cast<Eigen::Index>(k)]);
  }
  SparseMatrix B(static_cast<Eigen::Index>(positions.size()), static_cast<Eigen::Index>(controls));
  B.setFromTriplets(triplets.begin(), triplets.end());
  return B;
}

SparseMatrix third_differences(std::size_t controls) {
  constexpr std::array<double, 4> kStencil = {-1.0, 3.0, -3.0, 1.0};
  Triplets triplets;
  for (std::size_t row = 0; row + 3 < controls; ++row)
    for (std::size_t k = 0; k < kStencil.size(); ++k)
      triplets.emplace_back(static_cast<int>(row), static_cast<int>(row + k), kStencil[k]);
  SparseMatrix D(static_cast<Eigen::Index>(controls - 3), static_cast<Eigen::Index>(controls));
  D.setFromTriplets(triplets.begin(), triplets.end());
  return D;
}

using Control = SplineTrajectory::Control;

// Controls with the signs of quaternions aligned. q and -q are the same rotation, but not the same
// control.
std::vector<Control> aligned(std::vector<Control> controls) {
  for (std::size_t k = 1; k < controls.size(); ++k) {
    auto q = controls[k].tail<4>();
    if (q.dot(controls[k - 1].tail<4>()) < 0.0) q = -q.eval();
  }
  return controls;
}

Eigen::Quaterniond quaternion(const Eigen::Vector4d& xyzw) {
  return Eigen::Quaterniond(xyzw);
}

}  // namespace

QuinticBasis QuinticBasis::at(double u) {
  const double u2 = u * u, u3 = u2 * u, u4 = u3 * u;
  Weights powers, slope, bend;
  powers << 1.0, u, u2, u3, u4, u4 * u;
  slope << 0.0, 1.0, 2.0 * u, 3.0 * u2, 4.0 * u3, 5.0 * u4;
  bend << 0.0, 0.0, 2.0, 6.0 * u, 12.0 * u2, 20.0 * u3;
  const Matrix6d& M = coefficients();
  return {M * powers, M * slope, M * bend};
}

Eigen::MatrixXd fit_spline(std::span<const double> positions, const Eigen::MatrixXd& values,
                           const SplineFitOptions& options) {
  const SparseMatrix B = curve_matrix(positions, options.controls);
  const SparseMatrix D = third_differences(options.controls);
  const SparseMatrix smoothness =
      SparseMatrix(D.transpose() * D) / (options.roughness * options.roughness);
  const double variance = options.noise * options.noise;

  Eigen::VectorXd weights = Eigen::VectorXd::Constant(values.rows(), 1.0 / variance);
  Eigen::SimplicialLDLT<SparseMatrix> solver;
  Eigen::MatrixXd controls;
  for (int k = 0; k < kReweightings; ++k) {
    const SparseMatrix weighted = weights.asDiagonal() * B;
    const SparseMatrix normal = SparseMatrix(B.transpose() * weighted) + smoothness;
    if (k == 0) solver.analyzePattern(normal);
    solver.factorize(normal);
    controls = solver.solve(weighted.transpose() * values);
    const Eigen::VectorXd residual2 = (values - B * controls).rowwise().squaredNorm();
    weights = (variance + residual2.array() / (kOutlier * kOutlier)).inverse();  // Cauchy's weight
  }
  return controls;
}

SplineTrajectory::SplineTrajectory(double start_s, double interval_s, std::vector<Control> controls)
    : curve_(start_s, interval_s, aligned(std::move(controls))) {}

BodyMotion SplineTrajectory::motion(double t_s) const {
  if (!(start_s() <= t_s && t_s <= end_s()))
    throw std::out_of_range("trajectory: time " + std::to_string(t_s) + " s is outside [" +
                            std::to_string(start_s()) + ", " + std::to_string(end_s()) + "]");
  const auto sample = curve_.at(t_s);
  const Eigen::Quaterniond s = quaternion(sample.value.tail<4>());
  const Eigen::Quaterniond s_dot = quaternion(sample.first.tail<4>());
  return {make_pose(s.normalized().toRotationMatrix(), sample.value.head<3>()),
          sample.first.head<3>(), sample.second.head<3>(),
          2.0 / s.squaredNorm() * (s.conjugate() * s_dot).vec()};
}

SplineTrajectory::Control spline_control(const SE3& T) {
  Control control;
  control << T.translation(), Eigen::Quaterniond(T.linear()).normalized().coeffs();
  return control;
}

SplineTrajectory spline_along(double start_s, double interval_s, std::span<const SE3> poses) {
  std::vector<Control> controls;
  for (const SE3& T : poses) controls.push_back(spline_control(T));
  return {start_s, interval_s, std::move(controls)};
}

}  // namespace km
