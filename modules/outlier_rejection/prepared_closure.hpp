#pragma once

#include "modules/core/covariance.hpp"
#include "modules/core/pose_graph.hpp"
#include "modules/outlier_rejection/block_covariance.hpp"

namespace km {

/// A closure turned so that a.id < b.id: the direction it was measured in does not matter to a
/// cycle. Covariances are scaled to what the test assumes.
struct OrientedClosure {
  ClosureId id;
  OdometryPose a;
  OdometryPose b;
  UncertainPose T_a_b;
};

/// What every cycle through this closure takes from it, computed once.
///
/// Seen from odom_a, where robot a began, covariances do not depend on the rest of the cycle: that
/// of the closure is one matrix, and that of the odometry between two keyframes is the difference
/// of what had accumulated at each.
struct PreparedClosure {
  explicit PreparedClosure(const OrientedClosure& closure);

  ClosureId id;
  KeyframeId a, b;
  Eigen::Vector3d t_odoma_a;
  SE3 T_odoma_odomb;           ///< Where b's odometry began, as this closure has it.
  BlockCovariance odometry_a;  ///< Accumulated at a, seen from odom_a.
  BlockCovariance odometry_b;  ///< Accumulated at b, seen from odom_b.
  BlockCovariance measured;    ///< Of the closure, at b, seen from odom_a.
};

}  // namespace km
