#include "modules/vio/residuals/imu_cost.hpp"

#include "modules/vio/residuals/pose_block.hpp"

namespace km {

bool ImuCost::Evaluate(double const* const* parameters, double* residuals,
                       double** jacobians) const {
  const OdometryState i = state_of(parameters[0], parameters[1]);
  const OdometryState j = state_of(parameters[2], parameters[3]);
  if (jacobians == nullptr) {
    Eigen::Map<Vector15>{residuals} = factor_.error(i, j);
    return true;
  }
  const ImuTerm term =
      factor_.linearize(i, j, first_estimates_[0].applied_to(i), first_estimates_[1].applied_to(j));
  Eigen::Map<Vector15>{residuals} = term.r;
  const Matrix15* J[] = {&term.J_i, &term.J_i, &term.J_j, &term.J_j};
  for (int block = 0; block < 4; ++block) {
    if (jacobians[block] == nullptr) continue;
    if (block % 2 == 0) {
      Eigen::Map<Eigen::Matrix<double, 15, 7, Eigen::RowMajor>> map(jacobians[block]);
      map << J[block]->leftCols<6>(), Vector15::Zero();
    } else {
      Eigen::Map<Eigen::Matrix<double, 15, 9, Eigen::RowMajor>>{jacobians[block]} =
          J[block]->rightCols<9>();
    }
  }
  return true;
}

}  // namespace km
