#pragma once

#include <ceres/cost_function.h>

#include "modules/vio/marginalization.hpp"

namespace km {

/// StatePrior for Ceres. Blocks: pose 0 (7), motion 0 (9), pose 1 (7), pose 2 (7), ... The
/// derivative is the prior's J at every state: its first estimate.
class PriorCost final : public ceres::CostFunction {
 public:
  /// Precondition: `prior` is not empty.
  explicit PriorCost(StatePrior prior);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  StatePrior prior_;
};

}  // namespace km
