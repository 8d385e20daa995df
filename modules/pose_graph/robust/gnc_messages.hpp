#pragma once

#include <cstdint>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"

namespace km {

/// Public poses of a robot, between two updates of the weights.
struct GncPoses {
  RobotId robot = 0;
  std::uint32_t update = 0;            ///< That they are for.
  std::vector<SE3> T_world_pose = {};  ///< In the order of its NewtonHello.
};

/// Residuals of the edges that a robot decides: its own, and those to robots with higher ids.
struct GncResiduals {
  RobotId robot = 0;
  std::uint32_t update = 0;
  std::uint32_t between = 0;  ///< Closures to others, the first links of its NewtonHello.
  std::uint32_t inside = 0;   ///< Closures inside the robot, next; then steps of its odometry.
  std::vector<float> residuals = {};  ///< [sigma].
};

}  // namespace km
