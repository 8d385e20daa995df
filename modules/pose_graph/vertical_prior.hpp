#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "modules/core/geometry.hpp"

namespace km {

/// Which way is up at a pose, by inertial sensing. Its cost, weight ||Y up - z||^2 with z the third
/// column of lifting_matrix(), is (tilt / sigma)^2 for small tilts if weight = 1 / sigma^2; turns
/// about the vertical and translations cost nothing. It holds where the frame of the solution has
/// z up. On the rotations it is linear: ||Y up||^2 is 1.
struct VerticalPrior {
  Eigen::Index pose = 0;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< Unit, against gravity, in the pose's frame.
  double weight = 1.0;                            ///< [1/rad^2]
};

/// Of lifted rotation `Y` (r x 3).
[[nodiscard]] double vertical_cost(const VerticalPrior& prior,
                                   const Eigen::Ref<const Eigen::MatrixXd>& Y);

/// `poses` turned as a whole, about the origin and the least, so that the weighted sum of what
/// their priors hold for up, R_i up_i, points to z. As they are if there are no priors.
[[nodiscard]] std::vector<SE3> levelled(std::vector<SE3> poses,
                                        std::span<const VerticalPrior> priors);

/// `world` = [Y p] (r x 4) turned the least, about its point `origin`, so that its z axis is the
/// vertical z of the lifted frame.
[[nodiscard]] Eigen::MatrixXd level(const Eigen::MatrixXd& world, const Eigen::Vector3d& origin);

}  // namespace km
