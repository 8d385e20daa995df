#include "modules/pose_graph/frame_motion.hpp"

#include <Eigen/Eigenvalues>

#include "modules/core/lie.hpp"

namespace km {

Matrix6 frame_motion(const SE3& T_world_origin, bool upright) {
  const Eigen::Matrix3d& R = T_world_origin.linear();
  const Eigen::Matrix3d t_cross = skew(T_world_origin.translation());
  Matrix6 M = Matrix6::Zero();
  M.topLeftCorner<3, 3>() = R;
  if (upright) M.topLeftCorner<2, 3>().setZero();
  M.bottomLeftCorner<3, 3>() = t_cross * M.topLeftCorner<3, 3>();
  M.bottomRightCorner<3, 3>() = R;
  return M;
}

Matrix6 relative_to_origin(const Matrix6& P, const Matrix6& X, const Matrix6& C,
                           const SE3& T_world_kf) {
  const Eigen::Matrix3d R_t = T_world_kf.linear().transpose();
  Matrix6 A = Matrix6::Zero();
  A.topLeftCorner<3, 3>() = R_t;
  A.bottomLeftCorner<3, 3>() = -R_t * skew(T_world_kf.translation());
  A.bottomRightCorner<3, 3>() = R_t;
  const Matrix6 relative = P - X * A.transpose() - A * X.transpose() + A * C * A.transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(0.5 * (relative + relative.transpose()));
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
         eigen.eigenvectors().transpose();
}

}  // namespace km
