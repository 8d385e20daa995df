#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "modules/core/geometry/geometry.hpp"

namespace km {

/// The vertical at a pose, from inertial sensing. The cost is weight ||Y up - z||^2, where z is the
/// third unit vector. It is (tilt / sigma)^2 for small tilts if weight = 1 / sigma^2; rotations
/// about the vertical and translations cost nothing. The prior is valid if the frame of the
/// solution has z up. Up to a constant, the cost is linear in the rotation, because ||Y up||^2 is
/// 1.
struct VerticalPrior {
  Eigen::Index pose = 0;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< Unit vector against gravity, in pose frame.
  double weight = 1.0;                            ///< [1/rad^2]
};

/// Cost of the prior at the lifted rotation `Y` (r x 3).
[[nodiscard]] double vertical_cost(const VerticalPrior& prior,
                                   const Eigen::Ref<const Eigen::MatrixXd>& Y);

/// Rotates `poses` as a whole about the origin, by the smallest rotation after which the weighted
/// sum of their measured verticals, R_i up_i, points to z. Returns `poses` unchanged if there are
/// no priors.
[[nodiscard]] std::vector<SE3> levelled(std::vector<SE3> poses,
                                        std::span<const VerticalPrior> priors);

/// Rotates `world` = [Y p] (r x 4) about its point `origin`, by the smallest rotation after which
/// its z axis is the vertical z of the lifted frame.
[[nodiscard]] Eigen::MatrixXd level(const Eigen::MatrixXd& world, const Eigen::Vector3d& origin);

}  // namespace km
