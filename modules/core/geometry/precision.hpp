#pragma once

#include <cmath>
#include <stdexcept>

#include "modules/core/geometry/geometry.hpp"

namespace km {

/// Weights of one relative pose in the cost of pose graphs,
///     F = sum kappa ||R_j - R_i R_ij||_F^2 + tau ||t_j - t_i - R_i t_ij||^2   (no factor 1/2).
struct Precision {
  double kappa = 1.0;  ///< Concentration of the rotation (isotropic Langevin) [1/rad^2].
  double tau = 1.0;    ///< Weight of the translation [1/m^2].
};

/// Isotropic weights of a 6x6 covariance, tangent [rotation; translation], as SE-Sync reads g2o
/// files (Rosen et al., "SE-Sync", IJRR 2019). With the diagonal blocks I_R, I_t of the information
/// matrix, kappa = 3 / (2 tr I_R^-1) and tau = 3 / tr I_t^-1. I_R^-1 is the covariance of the
/// rotation if the translation is known. With a long lever arm between the two, it is much smaller
/// than that of the rotation alone. Only the upper triangle counts, which is what robots send: all
/// of them compute equal weights, to the last bit. A covariance that is singular has the weights of
/// its own blocks. Throws std::invalid_argument unless the traces are positive and finite.
[[nodiscard]] Precision precision_of(const Matrix6& covariance);

/// Weights in the plane, of the rows angle, x and y: kappa = I_33 and tau = 2 / tr I_t^-1. Throws
/// std::invalid_argument if these rows are not positive definite.
[[nodiscard]] Precision planar_precision_of(const Matrix6& covariance);

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
