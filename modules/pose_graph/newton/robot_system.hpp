#pragma once

#include <span>
#include <vector>

#include "modules/pose_graph/newton/edge_model.hpp"
#include "modules/pose_graph/newton/kept_edge.hpp"
#include "modules/pose_graph/newton/robot_graph.hpp"

namespace km {

/// One robot's part of a linear system over the nodes of its graph, A X = C, with A of B x B blocks
/// and C (B nodes) x k. Edges belong to one robot each, so the parts of a team add up to the whole.
struct RobotSystem {
  BlockMatrix A;
  Eigen::MatrixXd C;
  double cost = 0.0;  ///< Of the robot's edges.
};

/// Unknowns per pose of a step on SE(d): [w; v], of a planar pose [w_z; v_x; v_y].
inline Eigen::Index tangent_size(int dimension) {
  return dimension == 2 ? 3 : 6;
}

/// Newton's equations H xi = -g for one step from `poses` (one per node); k = 1. Each robot's H may
/// be of another curvature.
[[nodiscard]] RobotSystem newton_system(const RobotGraph& graph, std::span<const SE3> poses,
                                        int dimension, Curvature curvature);
/// The same, but A without the edges between kept poses.
[[nodiscard]] RobotSystem eliminated_system(const RobotGraph& graph, std::span<const SE3> poses,
                                            int dimension, Curvature curvature);
/// Those edges.
[[nodiscard]] std::vector<KeptEdge> kept_edges(const RobotGraph& graph, std::span<const SE3> poses);

/// Newton's equations without A.
[[nodiscard]] RobotSystem newton_slope(const RobotGraph& graph, std::span<const SE3> poses,
                                       int dimension);

/// First stage of chordal initialisation (see chordal.hpp): the unknowns are all matrices R_i^T
/// stacked, B = k = d. C is zero: one of them has to be given.
[[nodiscard]] RobotSystem rotation_system(const RobotGraph& graph, int dimension);

/// Second stage: translations for the rotations of `poses`, B = 1, k = d, row i being t_i^T.
[[nodiscard]] RobotSystem translation_system(const RobotGraph& graph, std::span<const SE3> poses,
                                             int dimension);

/// The step of one pose, of B entries, as a tangent vector of SE(3).
[[nodiscard]] Vector6 tangent_of(const Eigen::Ref<const Eigen::VectorXd>& step);

/// The inverse of tangent_of() for B unknowns.
[[nodiscard]] Eigen::VectorXd step_of(const Vector6& xi, Eigen::Index block);

/// The rotation nearest to the transpose of solved block `X` (d x d), in SO(3).
[[nodiscard]] Eigen::Matrix3d rotation_of(const Eigen::Ref<const Eigen::MatrixXd>& X);

}  // namespace km
