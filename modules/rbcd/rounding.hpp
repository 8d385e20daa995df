#pragma once

#include <vector>

#include "modules/rbcd/stiefel.hpp"

namespace km {

/// Rigid poses from lifted poses, in the frame of the lifted pose `anchor` = [Y p] (r x 4): R_i =
/// the rotation nearest to Y^T Y_i, t_i = Y^T (p_i - p). Every robot rounds its own block with the
/// same anchor, so that all blocks are in one frame (Tian et al., TRO 2021, Sec. III, rounding).
/// Exact if X is a lifted set of rigid poses.
[[nodiscard]] std::vector<SE3> round_to_poses(const LiftedPoses& X, const Eigen::MatrixXd& anchor);

}  // namespace km
