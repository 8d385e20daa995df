#pragma once

#include <Eigen/Core>

#include "modules/core/geometry.hpp"

namespace km {

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

}  // namespace km
