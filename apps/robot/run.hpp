#pragma once

#include <functional>

#include "apps/robot/robot_config.hpp"
#include "runtime/supervisor.hpp"

namespace km {

struct Topics;

/// Runs one robot from its input to its result files. Returns the exit code of the process; where a
/// module hangs, its thread is left behind and the process ended here, after the results of all
/// others. Throws for bad input and configuration, before anything runs. `listen`, for tests, is
/// shown the robot's topics before it starts.
int run_robot(const RobotOptions& options, SignalWatch& signals,
              const std::function<void(Topics&)>& listen = {});

}  // namespace km
