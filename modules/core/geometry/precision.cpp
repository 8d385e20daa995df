#include "modules/core/geometry/precision.hpp"

#include <Eigen/Cholesky>

namespace km {
namespace {

using Block = Eigen::Matrix3d;

Precision from_traces(double rotation, double translation) {
  if (!(rotation > 0.0 && translation > 0.0 && std::isfinite(rotation + translation)))
    throw std::invalid_argument("precision_of: a trace of the covariance is not positive");
  return {3.0 / (2.0 * rotation), 3.0 / translation};
}

// Trace of A - B C^-1 B^T, which is the inverse of A's block in the inverse of [A B; B^T C].
double conditional_trace(const Block& A, const Block& B, const Eigen::LLT<Block>& C) {
  return (A - B * C.solve(B.transpose())).trace();
}

}  // namespace

Precision precision_of(const Matrix6& covariance) {
  const Matrix6 Sigma = covariance.selfadjointView<Eigen::Upper>();
  const Block R = Sigma.topLeftCorner<3, 3>(), t = Sigma.bottomRightCorner<3, 3>();
  const Block C = Sigma.topRightCorner<3, 3>();
  const Eigen::LLT<Matrix6> whole(Sigma);
  const Eigen::LLT<Block> of_R(R), of_t(t);
  if (whole.info() != Eigen::Success) return from_traces(R.trace(), t.trace());
  return from_traces(conditional_trace(R, C, of_t), conditional_trace(t, C.transpose(), of_R));
}

Precision planar_precision_of(const Matrix6& covariance) {
  const Block Sigma = covariance.block<3, 3>(2, 2);  // angle, x, y
  const Eigen::LLT<Block> factor(Sigma);
  if (factor.info() != Eigen::Success || !Sigma.allFinite())
    throw std::invalid_argument("planar_precision_of: covariance is not positive definite");
  const Block information = factor.solve(Block::Identity());
  return {information(0, 0), 2.0 / information.bottomRightCorner<2, 2>().inverse().trace()};
}

}  // namespace km
