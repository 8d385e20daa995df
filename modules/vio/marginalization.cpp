#include "modules/vio/marginalization.hpp"

#include <utility>

#include "modules/core/lie.hpp"
#include "modules/core/symmetric_eigen.hpp"

namespace km {
namespace {

constexpr double kRankTolerance = 1e-12;

// S H S = V diag(lambda) V^T with S = diag(H)^-1/2, so that units do not decide the rank.
struct ScaledEigen {
  Eigen::VectorXd scale;
  Eigen::MatrixXd V;
  Eigen::VectorXd lambda;
  Eigen::Index first = 0;  // index of the first eigenvalue that counts
};

ScaledEigen decompose(const Eigen::MatrixXd& H) {
  ScaledEigen e;
  e.scale = H.diagonal().unaryExpr([](double h) { return h > 0.0 ? 1.0 / std::sqrt(h) : 0.0; });
  SymmetricEigen eigen = symmetric_eigen(e.scale.asDiagonal() * H * e.scale.asDiagonal());
  e.V = std::move(eigen.vectors);
  e.lambda = std::move(eigen.values);
  const double least = kRankTolerance * std::max(e.lambda(e.lambda.size() - 1), 0.0);
  while (e.first < e.lambda.size() && !(e.lambda(e.first) > least)) ++e.first;
  return e;
}

}  // namespace

SquareRootPrior marginalize(const Eigen::MatrixXd& H, const Eigen::VectorXd& g,
                            Eigen::Index count) {
  const Eigen::Index kept = H.rows() - count;
  Eigen::MatrixXd H_kept = H.bottomRightCorner(kept, kept);
  Eigen::VectorXd g_kept = g.tail(kept);
  if (count > 0) {
    const ScaledEigen e = decompose(H.topLeftCorner(count, count));
    const Eigen::Index rank = count - e.first;
    // W^T W is the pseudo-inverse of the block of H to be eliminated.
    const Eigen::MatrixXd W = e.lambda.tail(rank).cwiseSqrt().cwiseInverse().asDiagonal() *
                              e.V.rightCols(rank).transpose() * e.scale.asDiagonal();
    const Eigen::MatrixXd A = W * H.topRightCorner(count, kept);
    H_kept.noalias() -= A.transpose() * A;
    g_kept.noalias() -= A.transpose() * (W * g.head(count));
  }
  if (kept == 0) return {};
  const ScaledEigen e = decompose(H_kept);
  const Eigen::Index rank = kept - e.first;
  const Eigen::VectorXd root = e.lambda.tail(rank).cwiseSqrt();
  const Eigen::MatrixXd V_T = e.V.rightCols(rank).transpose();
  const Eigen::VectorXd unscale =
      e.scale.unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 0.0; });
  SquareRootPrior prior;
  prior.J = root.asDiagonal() * V_T * unscale.asDiagonal();
  prior.r = root.cwiseInverse().asDiagonal() * (V_T * (e.scale.asDiagonal() * g_kept));
  return prior;
}

Eigen::VectorXd prior_offset(const StatePrior& prior, std::span<const OdometryState* const> states,
                             const CameraCalibration& calibration) {
  Eigen::VectorXd dx(prior.dimension());
  for (std::size_t k = 0; k < states.size(); ++k) {
    const OdometryState& from = prior.linearization[k];
    const Eigen::Index column = k == 0 ? 0 : 9 + 6 * static_cast<Eigen::Index>(k);
    dx.segment<6>(column) = local_coordinates(from.T_odom_body, states[k]->T_odom_body);
    if (k == 0)
      dx.segment<9>(6) << states[k]->v_odom - from.v_odom, states[k]->gyro_bias - from.gyro_bias,
          states[k]->accel_bias - from.accel_bias;
  }
  if (prior.calibrates)
    dx.tail<kCalibrationSize>() = prior.calibration.local_coordinates_to(calibration);
  return dx;
}

}  // namespace km
