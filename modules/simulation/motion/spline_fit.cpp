#include "modules/simulation/motion/spline_fit.hpp"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>

#include "modules/simulation/motion/uniform_spline.hpp"

namespace km {
namespace {

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

}  // namespace

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

}  // namespace km
