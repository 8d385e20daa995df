#include "modules/vio/residuals/prior_cost.hpp"

#include <utility>

#include "modules/vio/residuals/pose_block.hpp"

namespace km {

PriorCost::PriorCost(StatePrior prior) : prior_(std::move(prior)) {
  set_num_residuals(static_cast<int>(prior_.r.size()));
  *mutable_parameter_block_sizes() = {7, 9};
  mutable_parameter_block_sizes()->resize(prior_.frames.size() + 1, 7);
}

bool PriorCost::Evaluate(double const* const* parameters, double* residuals,
                         double** jacobians) const {
  std::vector<OdometryState> states;
  states.push_back(state_of(parameters[0], parameters[1]));
  for (std::size_t k = 1; k < prior_.frames.size(); ++k)
    states.emplace_back().T_odom_body = pose_of(parameters[k + 1]);
  std::vector<const OdometryState*> pointers;
  for (const OdometryState& state : states) pointers.push_back(&state);
  Eigen::Map<Eigen::VectorXd>(residuals, prior_.r.size()) =
      prior_.J * prior_offset(prior_, pointers) + prior_.r;
  if (jacobians == nullptr) return true;

  Eigen::Index column = 0;
  for (std::size_t block = 0; block < parameter_block_sizes().size(); ++block) {
    const Eigen::Index size = block == 1 ? 9 : 6;
    if (jacobians[block] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> J(
          jacobians[block], prior_.r.size(), parameter_block_sizes()[block]);
      J.setZero();
      J.leftCols(size) = prior_.J.middleCols(column, size);
    }
    column += size;
  }
  return true;
}

}  // namespace km
