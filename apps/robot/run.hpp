#pragma once

#include "apps/robot/robot_config.hpp"
#include "runtime/supervisor.hpp"

namespace km {

/// Runs one robot from its input to its result files. Returns the exit code of the process.
/// Throws for bad input and configuration, before anything runs.
int run_robot(const RobotOptions& options, SignalWatch& signals);

}  // namespace km
