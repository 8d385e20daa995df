#pragma once

#include <Eigen/Core>
#include <vector>

#include "modules/core/geometry.hpp"

namespace km {

/// Tangent vectors of a robot's nodes and of the team's separators, one column each (see
/// robot_system.hpp).
struct TeamStep {
  Eigen::MatrixXd nodes;
  Eigen::MatrixXd separators;
};

/// Removes from `step` the rigid motion that leaves the separators at `separator_poses` no mean
/// rotation or translation. To first order that costs nothing; the step is as short as can be, and
/// which separator was held fixed to find it no longer shows. `upright`: only turns about z cost
/// nothing, others stay.
void remove_drift(TeamStep& step, const std::vector<SE3>& node_poses,
                  const std::vector<SE3>& separator_poses, bool upright);

/// `poses` moved along `scale` times the columns of `step`.
[[nodiscard]] std::vector<SE3> moved(const std::vector<SE3>& poses, const Eigen::MatrixXd& step,
                                     double scale);

}  // namespace km
