#pragma once

#include <span>
#include <vector>

#include "modules/pose_graph/odometry_breaks.hpp"
#include "modules/pose_graph/odometry_noise.hpp"
#include "modules/pose_graph/pose_edge.hpp"

namespace km {

/// Result of the comparison of the odometry of a robot with the closures inside it. By default,
/// odometry is as precise as it claims.
struct OdometryJudgement {
  std::vector<OdometryBreak> breaks = {};  ///< Wrong steps.
  OdometryNoise noise = {};                ///< Noise of the other steps.

  /// Corrects the weights of all `steps`, and the wrong steps.
  void correct(std::span<PoseEdge> steps) const;
};

/// `steps`: odometry from each keyframe to the next, as measured.
[[nodiscard]] OdometryJudgement judge_odometry(std::span<const PoseEdge> steps,
                                               std::span<const PoseEdge> closures);

}  // namespace km
