#pragma once

#include <ceres/sized_cost_function.h>

#include <optional>

#include "modules/vio/residuals/reprojection.hpp"

namespace km {

/// reprojection_error() for Ceres. Blocks: pose (7), point in odom (3). With a first estimate of
/// the pose, derivatives are taken there.
class ReprojectionCost final : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  ReprojectionCost(const ViewModel& view, const Eigen::Vector2d& bearing,
                   const std::optional<SE3>& first_estimate = std::nullopt)
      : view_(view), bearing_(bearing), first_estimate_(first_estimate) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  ViewModel view_;
  Eigen::Vector2d bearing_;
  std::optional<SE3> first_estimate_;
};

}  // namespace km
