#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "modules/core/ids.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// A measured position of a point of the body in an absolute frame: east-north-up about a datum, or
/// the frame of a motion capture. Robots with equal `datum` share that frame.
struct PositionFix {
  KeyframeId keyframe;                                ///< Nearest keyframe in time.
  Eigen::Vector3d p_datum = Eigen::Vector3d::Zero();  ///< Measured point [m].
  /// The same point in the frame of the keyframe [m]: the lever arm, and the motion between
  /// keyframe and measurement.
  Eigen::Vector3d p_kf = Eigen::Vector3d::Zero();
  double sigma_m = 1.0;  ///< Standard deviation on each axis.
  Stamp stamp = 0;       ///< Time of the measurement [ns].
  /// Errors of two fixes of a robot that are dt apart have the correlation exp(-dt / correlation_s)
  /// [s]; 0: independent.
  double correlation_s = 0.0;
  std::uint64_t datum = 0;  ///< Identity of the absolute frame; not 0.
};

/// State of the fixes of one robot in the pose graph.
struct FixesState {
  std::uint32_t used = 0;      ///< Fixes that agree with odometry and each other.
  std::uint32_t rejected = 0;  ///< Fixes that contradict them.
  /// Standard deviation of the rotation between trajectory and absolute frame [rad]. Infinite
  /// before it is determined.
  double rotation_sigma_rad = 0.0;
  /// True if the fixes determine the absolute frame: the poses are in it.
  bool located = false;
  double residual_m = 0.0;  ///< Root mean square distance of used fixes from the trajectory.
  bool operator==(const FixesState&) const = default;
};

}  // namespace km
