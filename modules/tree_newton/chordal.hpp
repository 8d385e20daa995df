#pragma once

#include <span>
#include <vector>

#include "modules/tree_newton/pose_edge.hpp"

namespace km {

/// Chordal initialisation of one robot (Carlone et al., "Initialization Techniques for 3D SLAM",
/// ICRA 2015, Sec. III-B): rotations minimise sum kappa ||R_j - R_i R_ij||_F^2 over all matrices,
/// and are then projected to SO(3). Translations minimise sum tau ||t_j - t_i - R_i t_ij||^2 given
/// these rotations. Pose 0 is the identity. Two sparse factorisations. Throws std::invalid_argument
/// if the edges do not connect all poses.
[[nodiscard]] std::vector<SE3> chordal_initialisation(Eigen::Index poses,
                                                      std::span<const PoseEdge> edges);

/// The one with the lower cost: `poses`, or the chordal initialisation from the own edges of the
/// robot, which begins at the first of `poses`. Throws std::invalid_argument if `own` does not
/// connect all poses.
[[nodiscard]] std::vector<SE3> better_of_chordal(std::vector<SE3> poses,
                                                 std::span<const PoseEdge> own);

}  // namespace km
