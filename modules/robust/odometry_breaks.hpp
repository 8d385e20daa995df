#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/tree_newton/pose_edge.hpp"

namespace km {

/// A wrong step of odometry, as after a loss of tracking, and its correction by closures.
struct OdometryBreak {
  std::size_t step = 0;      ///< From keyframe `step` to the next one.
  SE3 T_from_to;             ///< The step on which the closures agree.
  Precision precision = {};  ///< One standard deviation is the size of the jump.
  double jump_rad = 0.0;     ///< Rotation between the claimed step and T_from_to.
  double jump_m = 0.0;       ///< Translation between the claimed step and T_from_to.
  std::size_t places = 0;    ///< Number of places that agree.
};

/// Finds wrong steps of the odometry of one robot from the closures inside it, some of which may be
/// false; see Noise in METHOD.md. `steps[k]` is from keyframe k to keyframe k + 1.
///
/// Cycles are consistent, and jumps agree, up to the 99.9 % quantile of chi-squared at the claimed
/// noise. The limit is larger if the median error of the cycles without the step exceeds the
/// claimed noise, because noisy odometry increases the errors of all cycles. If successive steps
/// are in the same cycles, the one with the slowest correct step is taken. `seconds`: duration of
/// each step; if it is empty or has a value that is not positive, all steps last equally long.
/// `dimension` 2: poses are planar.
[[nodiscard]] std::vector<OdometryBreak> find_odometry_breaks(std::span<const PoseEdge> steps,
                                                              std::span<const PoseEdge> closures,
                                                              int dimension,
                                                              std::span<const double> seconds = {});

/// Replaces the wrong steps.
void correct_breaks(std::span<PoseEdge> steps, std::span<const OdometryBreak> breaks);

}  // namespace km
