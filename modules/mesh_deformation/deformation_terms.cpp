#include "modules/mesh_deformation/deformation_terms.hpp"

#include "modules/core/lie.hpp"

namespace km {

RigidityTerm rigidity_term(const SE3& T_world_a, const Eigen::Vector3d& point_a,
                           const SE3& T_world_b) {
  RigidityTerm term;
  term.residual = T_world_a * point_a - T_world_b.translation();
  term.by_a.leftCols<3>() = -T_world_a.linear() * skew(point_a);
  term.by_a.rightCols<3>() = T_world_a.linear();
  term.by_b.leftCols<3>().setZero();
  term.by_b.rightCols<3>() = -T_world_b.linear();
  return term;
}

RotationTerm rotation_term(const Eigen::Matrix3d& R_odom_kf, const SE3& T_world_kf,
                           const SE3& T_world_node) {
  const Eigen::Matrix3d R_kf_node = T_world_kf.linear().transpose() * T_world_node.linear();
  RotationTerm term;
  term.residual = so3_log(R_odom_kf * R_kf_node);
  const Eigen::Matrix3d J_r_inverse = so3_right_jacobian_inverse(term.residual);
  term.by_node.leftCols<3>() = J_r_inverse;
  term.by_node.rightCols<3>().setZero();
  // R_kf_node turns by exp(-d) from the left: the same as exp(-R_kf_node^T d) from the right.
  term.by_keyframe.leftCols<3>() = -J_r_inverse * R_kf_node.transpose();
  term.by_keyframe.rightCols<3>().setZero();
  return term;
}

AnchorTerm anchor_term(const SE3& anchor, const SE3& pose) {
  const Eigen::Matrix3d R_anchor_pose = anchor.linear().transpose() * pose.linear();
  AnchorTerm term;
  term.residual = local_coordinates(anchor, pose);
  term.by_pose.setZero();
  term.by_pose.topLeftCorner<3, 3>() = so3_right_jacobian_inverse(term.residual.head<3>());
  term.by_pose.bottomRightCorner<3, 3>() = R_anchor_pose;
  return term;
}

}  // namespace km
