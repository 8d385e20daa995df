#pragma once

#include <optional>

#include "apps/result_writer.hpp"
#include "apps/robot/assemblies/robot.hpp"
#include "apps/robot/final_room.hpp"
#include "apps/robot/robot_config.hpp"
#include "apps/robot/watch.hpp"
#include "runtime/signal_watch.hpp"
#include "runtime/supervisor.hpp"

namespace km {

/// A run whose nodes have stopped.
struct StoppedRun {
  const RobotOptions& options;
  const RobotConfig& config;
  Robot& robot;
  const RunResult& result;
  const RunRecord& record;  ///< Final.
};

/// Writes the results of the run and returns the exit code. `watch` is ended before the last lines
/// of the log, and `room` is released for the results. The state of a hung module is not read.
int conclude(const StoppedRun& run, std::optional<Watch>& watch, FinalRoom& room,
             ResultWriter& results, SignalWatch& signals);

}  // namespace km
