#pragma once

#include "modules/core/covariance.hpp"

namespace km {

/// The cycle up along one closure, along odometry, down along another closure, and back along
/// odometry. The first closure begins where it ends. Without noise, T() is the identity.
struct TwoClosureCycle {
  UncertainPose up;     ///< One closure, from its lower to its upper end.
  UncertainPose above;  ///< Odometry between the upper ends.
  UncertainPose down;   ///< The other closure, from its upper to its lower end.
  UncertainPose below;  ///< Odometry between the lower ends.

  [[nodiscard]] SE3 T() const { return up.T * above.T * down.T * below.T; }
  // Covariances of T(), in the tangent space at T(): of all noise, or of that of one source.
  [[nodiscard]] Matrix6 covariance() const;
  [[nodiscard]] Matrix6 covariance_of_odometry() const;
  [[nodiscard]] Matrix6 covariance_of_closures() const;
};

}  // namespace km
