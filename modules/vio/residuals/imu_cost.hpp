#pragma once

#include <ceres/sized_cost_function.h>

#include <array>

#include "modules/vio/residuals/imu_factor.hpp"

namespace km {

/// ImuFactor for Ceres. Blocks: pose i (7), motion i (9), pose j (7), motion j (9). What is given
/// of the first estimates replaces the current values where derivatives are taken.
class ImuCost final : public ceres::SizedCostFunction<15, 7, 9, 7, 9> {
 public:
  explicit ImuCost(const ImuFactor& factor, const FirstEstimate& i = {},
                   const FirstEstimate& j = {})
      : factor_(factor), first_estimates_{i, j} {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  ImuFactor factor_;
  std::array<FirstEstimate, 2> first_estimates_;
};

}  // namespace km
