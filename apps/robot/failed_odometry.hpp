#pragma once

#include <vector>

#include "apps/robot/robot_config.hpp"
#include "modules/diagnosis/finding.hpp"
#include "runtime/signal_watch.hpp"

namespace km {

/// Faults of images, calibration, units and signs that the first 30 s of the recording of `options`
/// show: possible causes for which odometry fails. kimera_multi_doctor states them in the same way.
/// Reads these images again, which takes some seconds. Empty without a recording, or if it cannot
/// be read.
[[nodiscard]] std::vector<Finding> causes_of_failed_odometry(const RobotOptions& options,
                                                             const RobotConfig& config,
                                                             SignalWatch& signals);

}  // namespace km
