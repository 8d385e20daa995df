#pragma once

#include <functional>

#include "apps/robot/robot_config.hpp"
#include "runtime/signal_watch.hpp"

namespace km {

struct Topics;

/// Runs one robot from its input to its result files. Returns the exit code of the process. If a
/// module hangs, its thread is left running and the process ends here, after the results of all
/// others. Throws for bad input and configuration, before any node runs. `listen`, for tests,
/// receives the robot's topics before it starts.
int run_robot(const RobotOptions& options, SignalWatch& signals,
              const std::function<void(Topics&)>& listen = {});

}  // namespace km
