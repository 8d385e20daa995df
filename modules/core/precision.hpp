#pragma once

#include <cmath>
#include <stdexcept>

#include "modules/core/geometry.hpp"

namespace km {

/// Weights of one relative pose in the cost of pose graphs,
///     F = sum kappa ||R_j - R_i R_ij||_F^2 + tau ||t_j - t_i - R_i t_ij||^2   (no factor 1/2).
struct Precision {
  double kappa = 1.0;  ///< Concentration of the rotation (isotropic Langevin) [1/rad^2].
  double tau = 1.0;    ///< Weight of the translation [1/m^2].
};

/// Isotropic weights of a 6x6 covariance, tangent [rotation; translation]: kappa = 3 / (2 tr
/// Sigma_R), tau = 3 / tr Sigma_t, as SE-Sync reads pose graphs (Rosen et al., "SE-Sync", IJRR
/// 2019). For block-diagonal information matrices of g2o both readings agree exactly; cross terms
/// are dropped. Throws std::invalid_argument unless both traces are positive and finite.
[[nodiscard]] inline Precision precision_of(const Matrix6& covariance) {
  const double rotation = covariance.topLeftCorner<3, 3>().trace();
  const double translation = covariance.bottomRightCorner<3, 3>().trace();
  if (!(rotation > 0.0 && translation > 0.0 && std::isfinite(rotation + translation)))
    throw std::invalid_argument("precision_of: a trace of the covariance is not positive");
  return {3.0 / (2.0 * rotation), 3.0 / translation};
}

/// The isotropic covariance with these weights: Sigma_R = 1/(2 kappa) I, Sigma_t = 1/tau I.
/// Throws std::invalid_argument unless both are positive and finite.
[[nodiscard]] inline Matrix6 covariance_of(const Precision& precision) {
  if (!(precision.kappa > 0.0 && precision.tau > 0.0 &&
        std::isfinite(precision.kappa + precision.tau)))
    throw std::invalid_argument("covariance_of: kappa and tau must be positive and finite");
  Matrix6 covariance = Matrix6::Zero();
  covariance.diagonal().head<3>().setConstant(0.5 / precision.kappa);
  covariance.diagonal().tail<3>().setConstant(1.0 / precision.tau);
  return covariance;
}

}  // namespace km
