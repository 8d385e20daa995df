#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/mesh_deformation/mesh_node.hpp"

namespace km {

/// Edge between a mesh node and a keyframe that saw it.
struct KeyframeEdge {
  KeyframeIndex keyframe = 0;
  std::uint32_t node = 0;
};

/// Terms of the energy of Kimera-Multi (Chang et al., ICRA 2021, Sec. IV, Eq. (1)), in the
/// undeformed configuration: the robot's odometry frame. It is a deformation graph as in Sumner,
/// Schmid, Pauly, "Embedded Deformation for Shape Manipulation", SIGGRAPH 2007.
struct DeformationGraph {
  std::vector<Eigen::Vector3d> nodes;               ///< g_k [m].
  std::vector<SE3> T_odom_kf;                       ///< Pose of keyframe i when it saw the nodes.
  std::vector<std::array<std::uint32_t, 2>> edges;  ///< Neighbouring nodes, each pair once.
  std::vector<KeyframeEdge> keyframe_edges;         ///< In ascending order of their nodes.
};

/// At most `keyframes_per_node` keyframes for each node: the first and the last that saw it, and
/// others spread evenly between them. If first and last are further apart than the window, only
/// these two are used. The surface was then left and seen again, and the keyframes in between may
/// not have seen it.
[[nodiscard]] std::vector<KeyframeEdge> choose_keyframe_edges(std::span<const MeshNode> nodes,
                                                              std::size_t keyframes_per_node,
                                                              KeyframeIndex max_gap_keyframes);

// Residuals of the deformation graph and their derivatives by the step of a pose's retract().

using Matrix36 = Eigen::Matrix<double, 3, 6>;

/// Difference between vertex b and its position as predicted by vertex a: second and third term of
/// Eq. (1) in Kimera-Multi (Chang et al., ICRA 2021, Sec. IV). Between two nodes it is the
/// regularisation of Sumner et al., "Embedded Deformation for Shape Manipulation", SIGGRAPH 2007.
struct RigidityTerm {
  Eigen::Vector3d residual;  ///< T_world_a * point_a - t_world_b [m].
  Matrix36 by_a;
  Matrix36 by_b;
};
[[nodiscard]] RigidityTerm rigidity_term(const SE3& T_world_a, const Eigen::Vector3d& point_a,
                                         const SE3& T_world_b);

/// Rotation of a node against a keyframe that saw it: log(R_odom_kf R_world_kf^T R_world_node). It
/// is zero if the correction from `odom` to `world` rotates the node as it rotates the keyframe.
struct RotationTerm {
  Eigen::Vector3d residual;  ///< [rad]
  Matrix36 by_keyframe;
  Matrix36 by_node;
};
[[nodiscard]] RotationTerm rotation_term(const Eigen::Matrix3d& R_odom_kf, const SE3& T_world_kf,
                                         const SE3& T_world_node);

/// First term of eq. (1): X - anchor as local_coordinates(), so that the pose is the anchor
/// retracted by the residual.
struct AnchorTerm {
  Vector6 residual;  ///< [rad; m]
  Matrix6 by_pose;
};
[[nodiscard]] AnchorTerm anchor_term(const SE3& anchor, const SE3& pose);

/// Standard deviations of the terms.
struct DeformationNoise {
  double anchor_rotation_rad = 0.001;
  double anchor_translation_m = 0.005;
  double mesh_edge_m = 0.05;
  double keyframe_edge_m = 0.02;
};

/// Conditions under which solve() ends.
struct DeformationStop {
  int max_iterations = 30;
  double energy_tolerance = 1e-5;  ///< A step changed the energy by less than this share.
};

/// Poses of all vertices of the graph.
struct DeformationPoses {
  std::vector<SE3> T_world_kf;    ///< X_i.
  std::vector<SE3> T_world_node;  ///< M_k; undeformed: identity rotation and g_k.
};

enum class DeformationStatus {
  kConverged,
  kIterationLimit,  ///< Poses are the best found.
  kFailed,          ///< The solver failed: poses are the initial ones.
};

/// "converged", "iteration limit", "failed"
[[nodiscard]] const char* to_string(DeformationStatus status);

struct [[nodiscard]] DeformationSolution {
  DeformationPoses poses;
  DeformationStatus status = DeformationStatus::kConverged;
  int iterations = 0;
  double initial_cost = 0.0;  ///< Half the sum of squares.
  double final_cost = 0.0;
};

/// First guess. Keyframes are at their anchors. Each node is at the
/// mean of the positions that its keyframes predict, with the rotation of its first keyframe.
/// `T_world_kf` are the optimised poses, as many as graph.T_odom_kf. Exact for every rigid motion.
[[nodiscard]] DeformationPoses initial_poses(const DeformationGraph& graph,
                                             std::span<const SE3> T_world_kf);

/// Minimises Eq. (1): anchors of the keyframes, rigidity between neighbouring nodes in both
/// directions, rigidity between keyframes and the nodes they saw. The method is Levenberg-Marquardt
/// on SE(3) with analytic, sparse Jacobians and conjugate gradients on the Schur complement of the
/// keyframes (Ceres), on one thread.
///
/// A weak term is added to those of the paper. It rotates each node with its keyframes (see
/// kRotationNoise_rad in the source). The minimum is then unique even if a node has few neighbours
/// or all of them are on one line. Keyframes without an edge to a node stay at their anchors;
/// without any such edge nodes stay as in `initial`.
[[nodiscard]] DeformationSolution solve(const DeformationGraph& graph,
                                        std::span<const SE3> T_world_kf,
                                        const DeformationNoise& noise, const DeformationStop& stop,
                                        DeformationPoses initial);

}  // namespace km
