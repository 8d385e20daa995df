#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/mesh_deformation/mesh_node.hpp"

namespace km {

/// A keyframe that saw a mesh node.
struct KeyframeTie {
  KeyframeIndex keyframe = 0;
  std::uint32_t node = 0;
};

/// What the energy of Kimera-Multi (Chang et al., ICRA 2021, Sec. IV, Eq. (1)) sums over, in the
/// undeformed configuration: the robot's odometry frame. It is a deformation graph as in Sumner,
/// Schmid, Pauly, "Embedded Deformation for Shape Manipulation", SIGGRAPH 2007.
struct DeformationGraph {
  std::vector<Eigen::Vector3d> nodes;               ///< g_k [m].
  std::vector<SE3> T_odom_kf;                       ///< Keyframe i's pose when it saw the nodes.
  std::vector<std::array<std::uint32_t, 2>> edges;  ///< Neighbouring nodes, each pair once.
  std::vector<KeyframeTie> ties;                    ///< By node.

  /// Both directions of every mesh edge; position and rotation of every tie.
  [[nodiscard]] std::size_t term_count() const { return 2 * edges.size() + 2 * ties.size(); }
};

/// At most `keyframes_per_node` keyframes for each node, of those that saw it: the first, the last,
/// and others spread over the time in between, where it is no longer than the window (over a longer
/// time the surface was left and seen again, and nothing is known about the keyframes between).
[[nodiscard]] std::vector<KeyframeTie> choose_ties(std::span<const MeshNode> nodes,
                                                   std::size_t keyframes_per_node,
                                                   KeyframeIndex window_keyframes);

// Residuals of the deformation graph and their derivatives by the step of a pose's retract().

using Matrix36 = Eigen::Matrix<double, 3, 6>;

/// Where a pose a puts a point that it carries, against where vertex b is: second and third term of
/// Eq. (1) in Kimera-Multi (Chang et al., ICRA 2021, Sec. IV); between two nodes the regularisation
/// of Sumner et al., "Embedded Deformation for Shape Manipulation", SIGGRAPH 2007.
struct RigidityTerm {
  Eigen::Vector3d residual;  ///< T_world_a * point_a - t_world_b [m].
  Matrix36 by_a;
  Matrix36 by_b;
};
[[nodiscard]] RigidityTerm rigidity_term(const SE3& T_world_a, const Eigen::Vector3d& point_a,
                                         const SE3& T_world_b);

/// How a node is turned against a keyframe that saw it: log(R_odom_kf R_world_kf^T R_world_node),
/// zero if both turned alike since.
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
  double keyframe_tie_m = 0.02;
};

/// When solve() ends.
struct DeformationStop {
  int max_iterations = 30;
  double energy_tolerance = 1e-7;  ///< A step changed the energy by less than this share.
};

/// Poses of all vertices of the graph.
struct DeformationPoses {
  std::vector<SE3> T_world_kf;    ///< X_i.
  std::vector<SE3> T_world_node;  ///< M_k; undeformed: identity rotation and g_k.
};

enum class DeformationStatus {
  kConverged,
  kIterationLimit,  ///< Poses are the best found.
  kFailed,          ///< The solver gave up: poses are the initial ones.
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

/// First guess without an earlier solution: keyframes at their anchors, each node where the
/// keyframes that are tied to it put it on average, turned like the first of them. `T_world_kf` are
/// the optimised poses, as many as graph.T_odom_kf. Exact for every motion that is rigid.
[[nodiscard]] DeformationPoses initial_poses(const DeformationGraph& graph,
                                             std::span<const SE3> T_world_kf);

/// First guess from the solution `last` for the anchors `T_world_kf_last`: every vertex moves like
/// its (first) keyframe's anchor moved since. Vertices that `last` lacks are as in initial_poses();
/// those it has must be the graph's first ones.
[[nodiscard]] DeformationPoses carried_over_poses(const DeformationGraph& graph,
                                                  const DeformationPoses& last,
                                                  std::span<const SE3> T_world_kf_last,
                                                  std::span<const SE3> T_world_kf);

/// Minimises eq. (1): anchors of the keyframes, rigidity between neighbouring nodes in both
/// directions, rigidity between keyframes and the nodes they saw; Levenberg-Marquardt on SE(3) with
/// analytic, sparse Jacobians and conjugate gradients on the Schur complement of the keyframes
/// (Ceres), one thread. To the paper's terms a weak
/// one is added that turns each node with its keyframes (see kRotationNoise_rad in the source): it
/// makes the minimum unique where a node has few neighbours, or all in one line. Keyframes without
/// a tie stay at their anchors; without any tie the result is `initial`.
[[nodiscard]] DeformationSolution solve(const DeformationGraph& graph,
                                        std::span<const SE3> T_world_kf,
                                        const DeformationNoise& noise, const DeformationStop& stop,
                                        DeformationPoses initial);

}  // namespace km
