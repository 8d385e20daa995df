#include "modules/vio/residuals/reprojection_cost.hpp"

#include "modules/vio/residuals/pose_block.hpp"

namespace km {

bool ReprojectionCost::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  const SE3 T_odom_body = pose_of(parameters[0]);
  const Eigen::Vector3d p_odom = Eigen::Map<const Eigen::Vector3d>(parameters[1]);
  ReprojectionTerm term;
  if (jacobians == nullptr) {
    if (!reprojection_error(view_, bearing_, T_odom_body, p_odom, term.r)) return false;
  } else {
    if (!linearize_reprojection(view_, bearing_, T_odom_body, first_estimate_.value_or(T_odom_body),
                                p_odom, term))
      return false;
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>> J(jacobians[0]);
      J << term.J_pose, Eigen::Vector2d::Zero();
    }
    if (jacobians[1] != nullptr)
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>{jacobians[1]} = term.J_point;
  }
  Eigen::Map<Eigen::Vector2d>{residuals} = term.r;
  return true;
}

}  // namespace km
